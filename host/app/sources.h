// The sources, a row each. Help texts, completion, messages and every choice between sources are
// made of the rows: a word is looked up once, by parse_source(), and nobody compares words after
// that.
#pragma once

#include <initializer_list>
#include <span>
#include <string>

#include "host/app/input.h"

namespace tagwrench {

struct SourceRow {
  SourceKind kind;
  const char* name;
  const char* argument;  ///< "DIR": what comes behind the colon
  bool stands_alone;     ///< without an argument, too
  const char* help;      ///< one line; may be empty
  bool own_time;         ///< its pictures are of another time than now
  Input (*open)(const InputOptions& options, const std::string& argument);
};

/// In the order of the help text.
std::span<const SourceRow> source_rows();

/// SRC as it was said, and its row.
struct SourceSpec {
  const SourceRow* row;
  std::string argument;

  bool is(SourceKind kind) const { return row->kind == kind; }
};

/// Throws ConfigError, with the sources that there are.
SourceSpec parse_source(const std::string& text);

/// Of an option --source that takes all of them.
std::string source_help();

/// "sim | sim:SCENARIO.yaml | images:DIR": of an option --source that takes some of them.
std::string source_forms(std::initializer_list<SourceKind> kinds);

}  // namespace tagwrench
