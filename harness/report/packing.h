#pragma once

#include <string>
#include <string_view>

namespace nullmark {

std::string base64(std::string_view bytes);

/// The bytes that a text in base64 stands for.
std::string from_base64(std::string_view text);

/// gzip in base64, as the page unpacks it.
std::string packed(const std::string& text);

}  // namespace nullmark
