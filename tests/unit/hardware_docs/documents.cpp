#include "documents.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace tagwrench::documents {
namespace {

std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      out.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  if (quoted) throw std::runtime_error("a quote is not closed: " + line);
  return out;
}

std::string trimmed(std::string_view text) {
  const auto visible = [](unsigned char c) { return !std::isspace(c) && c != '`'; };
  const auto begin = std::find_if(text.begin(), text.end(), visible);
  const auto end = std::find_if(text.rbegin(), text.rend(), visible).base();
  return begin < end ? std::string(begin, end) : std::string();
}

}  // namespace

std::string text_of(const std::string& path) {
  std::ifstream file(std::string(TAGWRENCH_SOURCE_DIR "/") + path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<Row> csv(const std::string& path) {
  std::istringstream lines(text_of(path));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = fields(line);
  std::vector<Row> out;
  while (std::getline(lines, line)) {
    const std::vector<std::string> values = fields(line);
    if (values.size() != names.size())
      throw std::runtime_error(path + ": not " + std::to_string(names.size()) + " fields: " + line);
    Row row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = values[i];
    out.push_back(row);
  }
  return out;
}

std::vector<std::vector<std::string>> markdown_table(const std::string& text,
                                                     std::string_view first_line) {
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line) && line != first_line) {
  }
  std::getline(lines, line);  // the rule
  std::vector<std::vector<std::string>> out;
  while (std::getline(lines, line) && line.starts_with('|')) {
    std::istringstream cells(line.substr(1));
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, '|');) row.push_back(trimmed(cell));
    out.push_back(row);
  }
  if (out.empty()) throw std::runtime_error("no table begins with " + std::string(first_line));
  return out;
}

double number(const std::string& text) {
  std::string plain = text;
  std::erase(plain, ',');
  try {
    return std::stod(plain);
  } catch (const std::exception&) {
    throw std::invalid_argument("not a number: '" + text + "'");
  }
}

}  // namespace tagwrench::documents
