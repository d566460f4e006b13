#include "host/web/server/web_options.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>

#include "host/core/config_error.h"
#include "host/core/os/unique_fd.h"
#include "host/core/parse.h"

namespace tagwrench {
namespace {

constexpr std::size_t kMin = 16;
constexpr std::size_t kMax = 128;
constexpr std::size_t kRandomCharacters = 43;  // 258 bits

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
static_assert(kAlphabet.size() == 64);

[[noreturn]] void token_trouble(const std::filesystem::path& file, std::string_view what) {
  throw ConfigError("--web-token " + file.string() + ": " + std::string(what));
}

bool is_token_text(std::string_view text) {
  return text.size() >= kMin && text.size() <= kMax &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return kAlphabet.find(c) != std::string_view::npos || c == '.' || c == '~';
         });
}

std::string random_token() {
  std::array<unsigned char, kRandomCharacters> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw ConfigError("--web-token: the kernel has no random numbers; write a token yourself");
  std::string text;
  for (const unsigned char byte : bytes) text += kAlphabet[byte % kAlphabet.size()];
  return text;
}

/// Nothing: somebody else has made it meanwhile.
std::optional<std::string> make_token(const std::filesystem::path& file) {
  const UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (!fd && errno == EEXIST) return {};
  const std::string text = random_token();
  const std::string line = text + '\n';
  if (!fd || ::write(fd.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    token_trouble(file, std::string("cannot be written: ") + std::strerror(errno) +
                            "; name a file in a folder of yours");
  return text;
}

std::string read_token(const std::filesystem::path& file, int fd) {
  struct stat facts {};
  if (::fstat(fd, &facts) != 0 || !S_ISREG(facts.st_mode)) token_trouble(file, "is not a file");
  if (facts.st_uid != ::geteuid() && facts.st_uid != 0)
    token_trouble(file, "is another user's, who knows the token; name a file of yours");
  if ((facts.st_mode & 077) != 0)
    token_trouble(file, "others may read it; chmod 600, and better write a new one");
  std::array<char, kMax + 2> bytes;
  const ssize_t size = ::read(fd, bytes.data(), bytes.size());
  std::string_view text(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.remove_suffix(1);
  if (!is_token_text(text))
    token_trouble(file,
                  "holds no token: 16 to 128 letters, digits, '-', '_', '.' or '~'; remove the "
                  "file to have one made");
  return std::string(text);
}

}  // namespace

WebOptions parse_web(const std::string& option, const std::string& place) {
  WebOptions options;
  options.option = option;
  if (place.empty()) return options;
  const std::size_t colon = place.rfind(':');
  const auto port = parse_whole<std::uint16_t>(std::string_view(place).substr(colon + 1));
  options.address = place.substr(0, std::min(colon, place.size()));
  if (options.address.size() >= 2 && options.address.front() == '[' &&
      options.address.back() == ']')
    options.address = options.address.substr(1, options.address.size() - 2);
  if (colon == std::string::npos || options.address.empty() || !port)
    throw ConfigError("{}:{}: is no ADDRESS:PORT; use web, or web:127.0.0.1:8137", option, place);
  options.port = *port;
  return options;
}

std::filesystem::path built_pages() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path above = program.parent_path().parent_path();
  const std::filesystem::path installed = above / "share/tagwrench/web";
  return std::filesystem::is_directory(installed, error) ? installed : above / "web";
}

std::string web_token(const std::filesystem::path& file) {
  UniqueFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd && errno == ENOENT) {
    if (std::optional<std::string> made = make_token(file)) return *std::move(made);
    fd.reset(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  }
  if (!fd)
    token_trouble(
        file, std::string("cannot be read: ") + std::strerror(errno) + "; name a file of yours");
  return read_token(file, fd.get());
}

std::string token_for_people(const std::string& token, const std::filesystem::path& file) {
  return ::isatty(STDERR_FILENO) == 1 ? token
                                      : fmt::format("... (the token is in {})", file.string());
}

}  // namespace tagwrench
