// What a GET gives: the built pages, the files that the bridge shows, and the headers that keep a
// page to itself. Knows nothing of connections.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "host/core/types.h"
#include "host/web/server/request_guard.h"

namespace tagwrench {

struct WebAnswer {
  unsigned status = 200;
  std::string fields;  ///< header lines, each with its end, without length and connection
  std::string text;    ///< the body, unless there is a file
  OpenedFile file{};
  Refusal refusal = Refusal::none;  ///< why, if it was refused
};

class StaticSite {
 public:
  StaticSite(std::filesystem::path pages, std::string token)
      : pages_(std::move(pages)), guard_(std::move(token)) {}

  void serve_folder(std::string url_prefix, std::filesystem::path folder) {
    folders_[std::move(url_prefix)] = std::move(folder);
  }
  void serve_file(std::string url, std::filesystem::path file) {
    files_[std::move(url)] = std::move(file);
  }

  WebAnswer answer(const WebRequest& request) const;
  const RequestGuard& guard() const noexcept { return guard_; }

 private:
  WebAnswer page(const WebRequest& request, SitePath path) const;
  WebAnswer file(const WebRequest& request, const SitePath& path) const;

  std::filesystem::path pages_;
  RequestGuard guard_;
  std::map<std::string, std::filesystem::path, std::less<>> folders_;
  std::map<std::string, std::filesystem::path, std::less<>> files_;
};

/// A short line of plain text, and the headers that everything has.
WebAnswer plain_answer(unsigned status, std::string_view line, Refusal refusal = Refusal::none);
/// In words for people and logs; what a stranger sent is not in it.
std::string_view refusal_text(Refusal refusal) noexcept;
unsigned refusal_status(Refusal refusal) noexcept;
std::string_view status_text(unsigned status) noexcept;

// Says what was refused: of each kind the first at once, then once a minute how many more.

class RefusalLog {
 public:
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  /// The line for people; empty if nothing is to be said now. Of `detail`, a stranger's text, a few
  /// harmless characters are shown.
  std::string line(Refusal refusal, std::string_view detail, TimePoint now);

 private:
  struct Kind {
    bool said = false;
    TimePoint when{};
    std::uint64_t more = 0;
  };
  std::array<Kind, 16> kinds_;
};

}  // namespace tagwrench
