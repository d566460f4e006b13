#include "host/web/server/static_site.h"

#include <fmt/format.h>

#include <utility>

namespace tagwrench {
namespace {

constexpr std::string_view kCommon =
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";
constexpr std::string_view kNothingAllowed = "default-src 'none'; frame-ancestors 'none'";
constexpr std::string_view kNobody =
    "camera=(), microphone=(), geolocation=(), usb=(), serial=(), hid=(), payment=()";
constexpr std::string_view kTheTab =
    "camera=(self), serial=(self), hid=(self), microphone=(), geolocation=(), usb=(), payment=()";
constexpr std::string_view kNotBuilt =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>tagwrench</title><h1>The "
    "pages are not built</h1><p>The bridge runs. What you wanted to see needs node, which builds "
    "the pages: run <code>./run web</code> in tagwrench's source folder, then load this page "
    "again.</p></html>\n";

struct RefusalRow {
  unsigned status;
  std::string_view text;  ///< for people and logs
};

/// In the order of Refusal.
constexpr RefusalRow kRefusals[] = {
    {200, ""},
    {403, "This address is not served: open http://localhost:PORT/ of the bridge."},
    {403, "Pages of other sites may not ask."},
    {401, "The token is missing or wrong: open the address that the bridge printed."},
    {403,
     "This sensor is another user's: open it as the user who runs the bridge, or with its "
     "--web-token."},
    {400, "The WebSocket protocol here is tagwrench.v1: load the page again."},
    {400, "No such path."},
    {503, "Too many pages are open: close one."},
    {413, "Too much, or too often."},
    {400, "This is not understood."},
};

const RefusalRow& row_of(Refusal refusal) { return kRefusals[static_cast<std::size_t>(refusal)]; }

constexpr std::pair<unsigned, std::string_view> kStatusTexts[] = {
    {200, "OK"},
    {304, "Not Modified"},
    {308, "Permanent Redirect"},
    {400, "Bad Request"},
    {401, "Unauthorized"},
    {403, "Forbidden"},
    {404, "Not Found"},
    {405, "Method Not Allowed"},
    {413, "Content Too Large"},
    {426, "Upgrade Required"},
    {431, "Request Header Fields Too Large"},
    {503, "Service Unavailable"},
};

/// What a file's name says about its content.
constexpr std::string_view content_type(std::string_view name) noexcept {
  constexpr std::pair<std::string_view, std::string_view> kTypes[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".wasm", "application/wasm"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".pdf", "application/pdf"},
      {".txt", "text/plain; charset=utf-8"},
      {".csv", "text/csv; charset=utf-8"},
      {".yaml", "text/plain; charset=utf-8"},
  };
  for (const auto& [ending, type] : kTypes)
    if (name.size() > ending.size() && name.ends_with(ending)) return type;
  return "application/octet-stream";
}

bool is_html(std::string_view name) { return name.ends_with(".html"); }
bool is_script(std::string_view name) { return name.ends_with(".js") || name.ends_with(".mjs"); }

/// A script's own policy counts where it is a worker, and there alone. The tab's loads a library of
/// others that makes functions from text; no page may.
std::string page_policy(const SitePath& path, std::string_view host) {
  const std::string& name = path.names.back();
  const bool tab = path.names.front() == "sensor";
  if (is_script(name) && tab)
    return "default-src 'none'; script-src 'self' 'wasm-unsafe-eval' 'unsafe-eval'; connect-src "
           "'self'";
  if (is_script(name)) return "default-src 'none'; script-src 'self'; connect-src 'self'";
  if (!is_html(name)) return std::string(kNothingAllowed);
  return fmt::format(
      "default-src 'none'; script-src 'self'{}; style-src 'self'; img-src 'self' data: blob:; "
      "font-src 'self'; media-src 'self' blob:; connect-src 'self' ws://{}; worker-src 'self'; "
      "manifest-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors "
      "'none'",
      tab ? " 'wasm-unsafe-eval'" : "", host);
}

/// Names under assets/ change with their content.
std::string_view caching(const SitePath& path) {
  const bool hashed = path.names.size() > 1 && path.names[path.names.size() - 2] == "assets";
  return hashed ? "public, max-age=31536000, immutable" : "no-cache";
}

std::string fields(std::string_view type, std::string_view policy, std::string_view allowed,
                   std::string_view cached) {
  return fmt::format(
      "{}Content-Type: {}\r\nContent-Security-Policy: {}\r\nPermissions-Policy: {}\r\n"
      "Cache-Control: {}\r\n",
      kCommon, type, policy, allowed, cached);
}

WebAnswer refused(Refusal refusal) {
  return plain_answer(refusal_status(refusal), refusal_text(refusal), refusal);
}

WebAnswer redirect(const SitePath& path) {
  WebAnswer answer = plain_answer(308, "This page has moved: add a slash.");
  answer.fields += "Location: " + path.text() + "/\r\n";
  return answer;
}

WebAnswer from_file(const WebRequest& request, OpenedFile file, std::string headers) {
  WebAnswer answer;
  const std::string tag = fmt::format("\"{:x}-{:x}\"", file.changed_ns, file.size);
  answer.fields = std::move(headers) + "ETag: " + tag + "\r\n";
  answer.status = request.if_none_match == tag ? 304 : 200;
  if (answer.status == 200) answer.file = std::move(file);
  return answer;
}

constexpr std::size_t kShown = 60;

std::string harmless(std::string_view text) {
  std::string out;
  for (const char c : text.substr(0, kShown)) out += c > ' ' && c < 127 && c != '"' ? c : '?';
  return out;
}

}  // namespace

WebAnswer StaticSite::answer(const WebRequest& request) const {
  if (request.method != "GET" && request.method != "HEAD") {
    WebAnswer answer = plain_answer(405, "Only GET and HEAD are served.", Refusal::nonsense);
    answer.fields += "Allow: GET, HEAD\r\n";
    return answer;
  }
  if (const Refusal refusal = guard_.page(request); refusal != Refusal::none)
    return refused(refusal);
  std::optional<SitePath> path = parse_target(request.target);
  if (!path) return refused(Refusal::path);
  if (!path->names.empty() && path->names.front() == "files") return file(request, *path);
  return page(request, *std::move(path));
}

WebAnswer StaticSite::page(const WebRequest& request, SitePath path) const {
  const bool other =
      !path.names.empty() && (path.names.front() == "sensor" || path.names.front() == "flip");
  if (other && path.names.size() == 1 && !path.folder) return redirect(path);
  if (!other) path.names.insert(path.names.begin(), "dashboard");
  const bool entrance = path.folder && path.names.size() == 1;
  if (path.folder) path.names.emplace_back("index.html");
  std::optional<OpenedFile> file = open_confined(pages_, path.names);
  const std::string& name = path.names.back();
  if (file) {
    const bool tab = path.names.front() == "sensor";
    return from_file(request, *std::move(file),
                     fields(content_type(name), page_policy(path, request.host),
                            tab ? kTheTab : kNobody, caching(path)));
  }
  if (!entrance) return plain_answer(404, "There is no such page here.");
  WebAnswer answer = plain_answer(503, "");
  answer.fields = fields("text/html; charset=utf-8", kNothingAllowed, kNobody, "no-store");
  answer.text = kNotBuilt;
  return answer;
}

WebAnswer StaticSite::file(const WebRequest& request, const SitePath& path) const {
  if (const Refusal refusal = guard_.file(request); refusal != Refusal::none)
    return refused(refusal);
  const std::string text = path.text();
  const std::size_t slash = text.rfind('/') + 1;
  const auto single = files_.find(text);
  const auto folder = folders_.find(std::string_view(text).substr(0, slash));
  std::optional<OpenedFile> file;
  if (single != files_.end())
    file = open_confined(single->second.parent_path(), {single->second.filename().string()});
  else if (folder != folders_.end() && !path.folder)
    file = open_confined(folder->second, {path.names.back()});
  if (!file) return plain_answer(404, "There is no such file here.");
  // A document of its own: it may look as it likes, and do nothing.
  const bool document = is_html(path.names.back());
  std::string headers = fields(content_type(path.names.back()),
                               document ? "sandbox; default-src 'none'; style-src 'unsafe-inline'; "
                                          "img-src data:; frame-ancestors 'self'"
                                        : kNothingAllowed,
                               kNobody, "no-cache");
  if (single == files_.end()) headers += "Content-Disposition: attachment\r\n";
  return from_file(request, *std::move(file), std::move(headers));
}

WebAnswer plain_answer(unsigned status, std::string_view line, Refusal refusal) {
  return {.status = status,
          .fields = fields("text/plain; charset=utf-8", kNothingAllowed, kNobody, "no-store"),
          .text = std::string(line) + '\n',
          .refusal = refusal};
}

std::string_view refusal_text(Refusal refusal) noexcept { return row_of(refusal).text; }
unsigned refusal_status(Refusal refusal) noexcept { return row_of(refusal).status; }

std::string_view status_text(unsigned status) noexcept {
  for (const auto& [number, text] : kStatusTexts)
    if (number == status) return text;
  return "Error";
}

std::string RefusalLog::line(Refusal refusal, std::string_view detail, TimePoint now) {
  Kind& kind = kinds_[static_cast<std::size_t>(refusal) % kinds_.size()];
  if (kind.said && now - kind.when < kQuiet) {
    ++kind.more;
    return {};
  }
  std::string line = "web: refused: " + std::string(refusal_text(refusal));
  if (!detail.empty()) line += " (\"" + harmless(detail) + "\")";
  if (kind.more > 0) line += " " + std::to_string(kind.more) + " more of these before.";
  kind = {true, now, 0};
  return line;
}

}  // namespace tagwrench
