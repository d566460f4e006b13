// Text of others on its way to a terminal or a log: names of devices and folders, keys of files.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace tagwrench {

/// The text with nothing in it that a terminal would obey or that would show it in another order:
/// control characters (C0, DEL, C1), line and paragraph separators, marks of direction and bytes
/// that are not UTF-8 become "\x1b" and the like, byte by byte.
std::string printable(std::string_view text);
/// The same without heap, cut between characters where there is no more room. The bytes written.
std::size_t write_printable(std::span<char> into, std::string_view text) noexcept;

}  // namespace tagwrench
