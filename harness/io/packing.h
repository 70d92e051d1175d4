#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace nullmark {

std::string base64(std::string_view bytes);

/// The bytes that a text in base64 stands for.
std::string from_base64(std::string_view text);

/// gzip in base64, as the page unpacks it.
std::string packed(const std::string& text);

/// The text that was packed; nothing where it is damaged or has more than `most` bytes.
std::optional<std::string> unpacked(std::string_view text, std::size_t most);

}  // namespace nullmark
