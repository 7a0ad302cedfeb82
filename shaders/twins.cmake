# Puts the shaders into `target`: the framework and the library as text, which is compiled when a
# metric is used, and each metric file both as text and, compiled as C++ in float64, as its twin.

# Sets `out` to the text of a file as a C++ raw string.
function(shader_text file out)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  set(${out} "R\"glsl(${text})glsl\"" PARENT_SCOPE)
endfunction()

# Adds shaders/framework/, shaders/lib/ and shaders/render/ as `merl::engine::shader_files()`.
function(add_shader_files target)
  file(GLOB files CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/shaders
       ${PROJECT_SOURCE_DIR}/shaders/framework/* ${PROJECT_SOURCE_DIR}/shaders/lib/*
       ${PROJECT_SOURCE_DIR}/shaders/render/*)
  list(SORT files)
  set(entries "")
  foreach(file IN LISTS files)
    shader_text(${PROJECT_SOURCE_DIR}/shaders/${file} text)
    string(APPEND entries "        {\"${file}\", ${text}},\n")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/metrics/shader_files.cpp @ONLY CONTENT
"#include <vector>

#include \"engine/metric/metric_library.h\"

namespace merl::engine {
std::span<const device::ShaderText> shader_files() {
    static const std::vector<device::ShaderText> all = {
${entries}    };
    return all;
}
}  // namespace merl::engine
")
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/metrics/shader_files.cpp)
endfunction()

# Adds every *.glsl of `folder`, a path from the root of the sources, as text and as its twin, and a
# function `merl::engine::<list>()` that gives them all. `kind` is metric or model, `type` what
# `header` declares for one, `ending` that of files beside them that twins are made of too; the
# templates follow.
function(add_twins target folder list kind type header ending)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.glsl)
  list(SORT files)
  set(declarations "")
  set(entries "")
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME_WE)
    string(MAKE_C_IDENTIFIER ${name} id)
    set(twin ${CMAKE_CURRENT_BINARY_DIR}/${kind}s/${id}.cpp)
    set(beside "")
    if(ending)
      set(beside ${PROJECT_SOURCE_DIR}/${folder}/${name}${ending})
    endif()
    add_custom_command(OUTPUT ${twin}
      COMMAND make_twin ${kind} ${file} ${folder}/${name}.glsl ${twin} ${ARGN}
      DEPENDS make_twin ${ARGN} ${file} ${beside} VERBATIM)
    target_sources(${target} PRIVATE ${twin})
    # Whatever a metric calls has to be inlined before its loop over voxels becomes vectors, and a
    # condition may only become a choice where nobody asks which operations raised a flag. In a twin
    # "float" is a macro, for double.
    set_source_files_properties(${twin} PROPERTIES
      COMPILE_OPTIONS "-fno-trapping-math;-finline-functions;$<$<CXX_COMPILER_ID:GNU>:--param=max-inline-insns-auto=1000;--param=max-inline-insns-single=1000;--param=inline-unit-growth=1000>;$<$<CXX_COMPILER_ID:Clang>:-Wno-keyword-macro>")
    string(APPEND declarations "extern const ${type} ${kind}_${id};\n")
    string(APPEND entries "glsl::${kind}_${id}, ")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${kind}s/${list}.cpp @ONLY CONTENT
"#include <vector>

#include \"${header}\"

namespace merl::engine {
namespace glsl {
${declarations}}
std::span<const ${type}> ${list}() {
    static const std::vector<${type}> all = {${entries}};
    return all;
}
}  // namespace merl::engine
")
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/${kind}s/${list}.cpp)
endfunction()

# Adds the metrics of `folder`; of those without a degree also the sum in float32. That is a file of its
# own for its options: literals are float32, and every number is finite, without which a choice of
# the smaller one takes two instructions; and instructions of two voxels alternate, which on x86-64 GCC does
# only when told. (What Clang has for OpenCL makes such literals in C++, too.)
function(add_metrics target folder list)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.glsl)
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME_WE)
    string(MAKE_C_IDENTIFIER ${name} id)
    set(single ${CMAKE_CURRENT_BINARY_DIR}/metrics/${id}_in_float32.cpp)
    set(template ${PROJECT_SOURCE_DIR}/engine/metric/single_twin.cpp.in)
    add_custom_command(OUTPUT ${single}
      COMMAND make_twin single ${file} ${folder}/${name}.glsl ${single} ${template}
      DEPENDS make_twin ${template} ${file} VERBATIM)
    target_sources(${target} PRIVATE ${single})
    set_source_files_properties(${single} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
      COMPILE_OPTIONS "-fno-trapping-math;-fno-math-errno;-ffinite-math-only;-fno-signed-zeros;-finline-functions;$<$<CXX_COMPILER_ID:Clang>:-Xclang;-cl-single-precision-constant>;$<$<CXX_COMPILER_ID:GNU>:-fsingle-precision-constant;-ffp-contract=fast;-fschedule-insns;-mprefer-vector-width=512;--param=max-inline-insns-auto=1000;--param=max-inline-insns-single=1000;--param=inline-unit-growth=1000>")
  endforeach()
  add_twins(${target} ${folder} ${list} metric BuiltMetric engine/metric/metric_library.h ""
            ${PROJECT_SOURCE_DIR}/engine/metric/twin.cpp.in
            ${PROJECT_SOURCE_DIR}/engine/metric/summary_twin.cpp.in)
endfunction()

# Adds the models of `folder`, each with its table.
function(add_models target folder list)
  add_twins(${target} ${folder} ${list} model BuiltModel engine/database/model.h .csv
            ${PROJECT_SOURCE_DIR}/engine/database/model_twin.cpp.in)
endfunction()
