// Tables that people read, as data: CSV files and tables in Markdown.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace tagwrench::documents {

/// Below the repository. Throws std::runtime_error if it cannot be read.
std::string text_of(const std::string& path);

using Row = std::map<std::string, std::string>;
/// By the names in the first line. Throws std::runtime_error where a line has another number of
/// fields.
std::vector<Row> csv(const std::string& path);

/// The cells of the table that begins with this line, without its head; backquotes are taken away.
std::vector<std::vector<std::string>> markdown_table(const std::string& text,
                                                     std::string_view first_line);

/// Throws std::invalid_argument with the text if it does not begin with a number.
double number(const std::string& text);

}  // namespace tagwrench::documents
