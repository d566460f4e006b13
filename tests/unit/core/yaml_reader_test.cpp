#include "host/core/yaml/yaml_reader.h"

#include <gtest/gtest.h>

#include "host/core/config_error.h"

namespace tagwrench {
namespace {

std::string complaint(const std::string& text) {
  try {
    YamlReader::from_text(text, "a.yaml");
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "(accepted)";
}

TEST(YamlDocuments, OneMayHaveItsMarkersCommentsAndDirectives) {
  for (const char* text : {"a: 1\n", "---\na: 1\n", "# by hand\n\n---\na: 1\n...\n",
                           "%YAML 1.2\n---\na: 1\n...\n# end\n", "a: |\n  ---\n  text\n",
                           "--- {a: 1}\n", "a: '--- no marker'\n", "---\r\na: 1\r\n...\r\n"})
    EXPECT_EQ(complaint(text), "(accepted)") << text;
}

TEST(YamlDocuments, ASecondIsRefusedByItsLine) {
  EXPECT_EQ(complaint("a: 1\n---\nb: 2\n"),
            "a.yaml:2: a second document begins here, and only one is read; remove it");
  EXPECT_TRUE(complaint("---\na: 1\n--- {b: 2}\n").starts_with("a.yaml:3: a second document"));
  EXPECT_TRUE(complaint("a: 1\n...\nb: 2\n").starts_with("a.yaml:3: a second document"));
  EXPECT_TRUE(complaint("a: 'open\n---\nb: 2'\n").starts_with("a.yaml:2: a second document"));
}

}  // namespace
}  // namespace tagwrench
