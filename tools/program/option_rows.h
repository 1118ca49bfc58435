// Options of commands that are those of the library: named and explained in engine/api/ballot_c_answers.h.
#pragma once

#include <CLI/CLI.hpp>
#include <deque>
#include <initializer_list>
#include <string>

#include "engine/api/query.h"

namespace ballot::cli {

/// Options of questions. Lives as long as the app.
class OptionRows {
 public:
  /// Adds --some-name for an option some_name of BallotQuery, with its text.
  void add_to(CLI::App& cmd, std::initializer_list<const char*> names);
  /// Returns the options as they were parsed.
  const BallotQuery& query() const { return query_; }

 private:
  BallotQuery query_;
  std::deque<std::string> texts_;
};

}  // namespace ballot::cli
