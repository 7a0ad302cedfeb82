#include "engine/device/instance.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>
#include <tuple>

#include "engine/base/error.h"

namespace merl::device {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr const char* kPortability = VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME;

/// The limits of this process that a driver may not fit into, as the rest of a sentence.
std::string lack_of_room() {
    std::string text;
    for (const auto& [resource, what, option] :
         {std::tuple(RLIMIT_AS, "address space", "-v"), {RLIMIT_DATA, "data", "-d"}}) {
        rlimit limit = {};
        if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
            text += fmt::format(
                "; the {} of this process is limited to {} MiB (ulimit {}), and a driver may need "
                "several hundred: raise it",
                what, limit.rlim_cur >> 20U, option);
        }
    }
    return text;
}

/// The variables with which a user, or a file that was sourced once, chooses drivers.
std::string hiding_variables() {
    std::string text;
    for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_LOADER_DRIVERS_SELECT",
                             "VK_LOADER_DRIVERS_DISABLE"}) {
        if (const char* value = std::getenv(name); value != nullptr) {
            text += fmt::format("; {} is \"{}\", which may hide it: unset it", name, value);
        }
    }
    // The loader looks nowhere else for what packages install.
    const char* directories = std::getenv("XDG_DATA_DIRS");
    if (directories != nullptr && std::strstr(directories, "/usr/share") == nullptr &&
        ::access("/usr/share/vulkan/icd.d", F_OK) == 0) {
        text += fmt::format("; XDG_DATA_DIRS is \"{}\", without /usr/share: add it", directories);
    }
    return text;
}

/// The library that a driver's manifest names; empty if it names none.
std::string library_of(const std::filesystem::path& manifest) {
    std::ifstream file(manifest);
    const auto json = nlohmann::json::parse(file, nullptr, false);
    const nlohmann::json::json_pointer place("/ICD/library_path");
    return json.contains(place) && json[place].is_string() ? json[place].get<std::string>() : "";
}

/// Where packages put them.
std::vector<std::filesystem::path> installed_manifests() {
    std::vector<std::filesystem::path> manifests;
    for (const char* folder : {"/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d",
                               "/etc/vulkan/icd.d", "/usr/local/etc/vulkan/icd.d"}) {
        std::error_code none;
        for (std::filesystem::directory_iterator i(folder, none), end; !none && i != end;
             i.increment(none)) {
            if (i->path().extension() == ".json") {
                manifests.push_back(i->path());
            }
        }
    }
    std::ranges::sort(manifests);
    return manifests;
}

/// The drivers that are installed where packages put them, and what keeps each from loading.
std::string installed_drivers() {
    std::string text;
    for (const auto& manifest : installed_manifests()) {
        auto library = library_of(manifest);
        if (library.find('/') != std::string::npos) {  // else the system looks for it
            library = (manifest.parent_path() / library).string();
        }
        void* const loaded = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
        text += fmt::format(
            "{}{}{}", text.empty() ? "" : ", ", manifest.string(),
            loaded != nullptr ? "" : fmt::format(" (its library {} cannot be loaded)", library));
        if (loaded != nullptr) {
            ::dlclose(loaded);
        }
    }
    return text;
}

}  // namespace

std::vector<std::filesystem::path> driver_manifests() {
    for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"}) {
        if (const char* value = std::getenv(name); value != nullptr) {
            std::vector<std::filesystem::path> manifests;
            std::istringstream files(value);
            for (std::string file; std::getline(files, file, ':');) {
                manifests.emplace_back(file);
            }
            return manifests;
        }
    }
    return installed_manifests();
}

std::string version_text(std::uint32_t version) {
    return fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                       VK_API_VERSION_PATCH(version));
}

vk::raii::Context make_loader() {
    try {
        return {};
    } catch (const std::runtime_error&) {
        const std::string room = lack_of_room();
        throw NoDriverError("the Vulkan loader (libvulkan.so.1) cannot be loaded" + room,
                            !room.empty());
    }
}

std::string validation_mode() {
    const char* value = std::getenv("MERL_SCAN_VALIDATE");
    return value ? value : "";
}

vk::raii::Instance make_instance(const vk::raii::Context& loader, const std::string& validate) {
    if (loader.enumerateInstanceVersion() < kVulkanVersion) {
        throw Error(Fault::device,
                    fmt::format("the Vulkan loader offers version {}, and 1.2 is needed",
                                version_text(loader.enumerateInstanceVersion())));
    }
    vk::ApplicationInfo application("merl-scan", 1, "merl-scan", 1, kVulkanVersion);
    std::vector<const char*> layers;
    std::vector<const char*> extensions;
    std::vector<vk::ValidationFeatureEnableEXT> features;
    if (!validate.empty()) {
        const auto available = loader.enumerateInstanceLayerProperties();
        if (std::none_of(available.begin(), available.end(), [](const auto& layer) {
                return std::strcmp(layer.layerName, kValidationLayer) == 0;
            })) {
            throw Error(Fault::device,
                        fmt::format("MERL_SCAN_VALIDATE is set, but {} is not installed "
                                    "(the Khronos validation layers)",
                                    kValidationLayer));
        }
        layers.push_back(kValidationLayer);
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        if (validate == "sync") {
            features.push_back(vk::ValidationFeatureEnableEXT::eSynchronizationValidation);
        } else if (validate == "gpu") {
            features.push_back(vk::ValidationFeatureEnableEXT::eGpuAssisted);
            features.push_back(vk::ValidationFeatureEnableEXT::eGpuAssistedReserveBindingSlot);
        } else if (validate != "core") {
            throw Error(Fault::usage,
                        fmt::format("MERL_SCAN_VALIDATE is \"{}\"; expected core, sync or "
                                    "gpu",
                                    validate));
        }
    }
    vk::ValidationFeaturesEXT validation(features);
    vk::InstanceCreateInfo create({}, &application, layers, {});
    // Without this the loader hides devices on which Vulkan is built upon something else (Metal).
    const auto offered = loader.enumerateInstanceExtensionProperties();
    if (std::any_of(offered.begin(), offered.end(), [](const auto& extension) {
            return std::strcmp(extension.extensionName, kPortability) == 0;
        })) {
        extensions.push_back(kPortability);
        create.flags |= vk::InstanceCreateFlagBits::eEnumeratePortabilityKHR;
    }
    create.setPEnabledExtensionNames(extensions);
    if (!features.empty()) {
        create.pNext = &validation;
    }
    try {
        return {loader, create};
    } catch (const vk::IncompatibleDriverError&) {
        return nullptr;  // what the loader says when it finds no driver at all
    }
}

std::vector<vk::raii::PhysicalDevice> enumerate(const vk::raii::Instance& instance) {
    if (!*instance) {
        return {};
    }
    try {
        return vk::raii::PhysicalDevices(instance);
    } catch (const vk::InitializationFailedError&) {
        return {};
    }
}

NoDriverError why_no_device() {
    const std::string installed = installed_drivers();
    const std::string reasons = hiding_variables() + lack_of_room();
    if (installed.empty()) {
        return {"no Vulkan driver is installed" + reasons, !reasons.empty()};
    }
    return {fmt::format("no Vulkan driver found, although there is {}{}", installed, reasons),
            true};
}

}  // namespace merl::device
