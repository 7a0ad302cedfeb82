#pragma once

#include <string>
#include <vector>

namespace merl::app {

/// What a contact sheet shows: the image FILE.png in its directory, with a name below it.
struct ContactImage {
    std::string file;
    std::string name;
};

/// An HTML page of images, in their order.
std::string contact_page(const std::string& title, const std::vector<ContactImage>& images);

}  // namespace merl::app
