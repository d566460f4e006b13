#include "host/web/server/site_path.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>

namespace tagwrench {
namespace {

constexpr std::size_t kMaxTarget = 1024;
constexpr std::size_t kDeepestFolder = 8;

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/// Once: what is still an escape then is no character of a name.
std::optional<std::string> unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return {};
    const int high = hex_value(text[i + 1]);
    const int low = hex_value(text[i + 2]);
    if (high < 0 || low < 0) return {};
    out += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return out;
}

}  // namespace

std::string SitePath::text() const {
  std::string out;
  for (const std::string& name : names) out += '/' + name;
  return folder || out.empty() ? out + '/' : out;
}

bool is_file_name(std::string_view name) noexcept {
  constexpr std::string_view kMarks = "-_.~@+";
  const auto fits = [&](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           kMarks.find(c) != std::string_view::npos;
  };
  return !name.empty() && name.size() <= 255 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), fits);
}

std::optional<SitePath> parse_target(std::string_view target) {
  if (target.empty() || target.front() != '/' || target.size() > kMaxTarget) return {};
  std::string_view left = target.substr(1, std::min(target.find('?'), target.size()) - 1);
  SitePath path;
  path.folder = left.empty() || left.back() == '/';
  while (!left.empty()) {
    const std::size_t end = std::min(left.find('/'), left.size());
    std::optional<std::string> name = unescaped(left.substr(0, end));
    if (!name || !is_file_name(*name) || path.names.size() == kDeepestFolder) return {};
    path.names.push_back(*std::move(name));
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return path;
}

std::optional<OpenedFile> open_confined(const std::filesystem::path& folder,
                                        const std::vector<std::string>& names) {
  constexpr int kSafely = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  UniqueFd at(::open(folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY));
  for (const std::string& name : names) {
    if (!at || !is_file_name(name)) return {};
    at.reset(::openat(at.get(), name.c_str(), kSafely));
  }
  struct stat facts {};
  if (!at || ::fstat(at.get(), &facts) != 0 || !S_ISREG(facts.st_mode)) return {};
  return OpenedFile{std::move(at), static_cast<std::uint64_t>(facts.st_size),
                    facts.st_mtim.tv_sec * std::int64_t{1'000'000'000} + facts.st_mtim.tv_nsec};
}

}  // namespace tagwrench
