#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>

#include "host/web/server/request_guard.h"
#include "tests/support/temporary_folder.h"

namespace tagwrench {
namespace {

using test::TemporaryFolder;

std::string read_all(const OpenedFile& file) {
  std::array<char, 64> bytes;
  const ssize_t size = ::read(file.fd.get(), bytes.data(), bytes.size());
  return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
}

TEST(WebPath, NamesAreTakenApart) {
  const auto path = parse_target("/sensor/assets/index-a1B2.js?query=/../x");
  ASSERT_TRUE(path);
  EXPECT_EQ(path->names, (std::vector<std::string>{"sensor", "assets", "index-a1B2.js"}));
  EXPECT_FALSE(path->folder);
  EXPECT_EQ(path->text(), "/sensor/assets/index-a1B2.js");
}

TEST(WebPath, TheRootAndASlashAtTheEndAreFolders) {
  ASSERT_TRUE(parse_target("/"));
  EXPECT_TRUE(parse_target("/")->names.empty());
  EXPECT_TRUE(parse_target("/?x")->folder);
  EXPECT_TRUE(parse_target("/sensor/")->folder);
  EXPECT_EQ(parse_target("/sensor/")->text(), "/sensor/");
}

TEST(WebPath, EscapesAreUndoneOnce) {
  EXPECT_EQ(parse_target("/%61%2Ejs")->text(), "/a.js");
  EXPECT_FALSE(parse_target("/%2561"));
}

TEST(WebPath, WhatCouldLeaveAFolderIsRefused) {
  for (const char* target : {"/..",
                             "/../x",
                             "/a/../b",
                             "/a/..",
                             "/%2e%2e/x",
                             "/%2E%2e%2fx",
                             "/a%2fb",
                             "/.%2e/x",
                             "/..%5cx",
                             "/a\\b",
                             "/a%00.js",
                             "/a%0",
                             "/a%",
                             "/a%zz",
                             "//etc/passwd",
                             "/a//b",
                             "/./a",
                             "/.git",
                             "/.hidden/x",
                             "etc",
                             "",
                             "http://localhost/",
                             "*",
                             "/a b",
                             "/a%20b",
                             "/\xc3\xa4",
                             "/a:b",
                             "/a;b",
                             "/%252e%252e/x"})
    EXPECT_FALSE(parse_target(target)) << target;
  EXPECT_FALSE(parse_target('/' + std::string(5000, 'a')));
  EXPECT_FALSE(parse_target("/a/b/c/d/e/f/g/h/i"));
}

TEST(WebPath, AFileBelowTheFolderIsOpened) {
  TemporaryFolder folder;
  folder.write("a/b.txt", "hello");
  const auto file = open_confined(folder.path(), {"a", "b.txt"});
  ASSERT_TRUE(file);
  EXPECT_EQ(file->size, 5U);
  EXPECT_EQ(read_all(*file), "hello");
}

TEST(WebPath, NoSymbolicLinkIsFollowed) {
  TemporaryFolder outside;
  outside.write("secret.txt", "secret");
  TemporaryFolder folder;
  folder.write("a.txt", "a");
  std::filesystem::create_symlink(outside / "secret.txt", folder / "link.txt");
  std::filesystem::create_directory_symlink(outside.path(), folder / "links");
  EXPECT_FALSE(open_confined(folder.path(), {"link.txt"}));
  EXPECT_FALSE(open_confined(folder.path(), {"links", "secret.txt"}));
  EXPECT_TRUE(open_confined(folder.path(), {"a.txt"}));
}

TEST(WebPath, OnlyRegularFilesAreOpened) {
  TemporaryFolder folder;
  folder.write("a/b.txt", "b");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_FALSE(open_confined(folder.path(), {"pipe"}));  // and does not wait for a writer
  EXPECT_FALSE(open_confined(folder.path(), {"a"}));
  EXPECT_FALSE(open_confined(folder.path(), {}));
  EXPECT_FALSE(open_confined(folder.path(), {"missing"}));
  EXPECT_FALSE(open_confined(folder / "missing", {"b.txt"}));
  EXPECT_FALSE(open_confined(folder.path(), {"..", "b.txt"}));
}

}  // namespace
}  // namespace tagwrench
