#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/database.h"
#include "engine/database/material_files.h"

namespace merl::engine {

/// Files of a database that cannot be used, all named on one line, like reasons().
class BadFilesError : public InputError {
  public:
    /// `files` is how many there are, good ones too.
    BadFilesError(const std::string& database, std::size_t files,
                  const std::vector<BadMaterial>& bad);

    /// Of several databases: what() of the error of each.
    explicit BadFilesError(const std::vector<std::string>& of_databases);
};

/// The same where bad ones were to be left out and none is left.
class NoGoodFileError : public BadFilesError {
  public:
    NoGoodFileError(const std::string& database, std::vector<BadMaterial> bad);

    const std::vector<BadMaterial>& bad() const { return bad_; }

  private:
    std::vector<BadMaterial> bad_;
};

/// The reasons, a line each: of many the first 20, and how many more there are.
std::vector<std::string> reasons(const std::vector<BadMaterial>& bad);

/// Calls `use` with every index below `count`, on several threads that have ended when this
/// returns. What each call threw as InputError, empty where it did not; anything else is thrown.
std::vector<std::string> faults_of(std::size_t count, const std::function<void(std::size_t)>& use);

/// Takes those out of `files` whose fault is not empty, and returns them. Throws, unless
/// options.skip_bad, BadFilesError when there is a fault, and NoGoodFileError where none is left.
std::vector<BadMaterial> skip_bad(const std::string& database, std::vector<MaterialFile>& files,
                                  const std::vector<std::string>& faults,
                                  const OpenOptions& options);

/// What the user should know of what is skipped: how many there are, then a line each, like
/// reasons(); nothing if there are none.
std::vector<std::string> skipped_lines(const Database& database);

/// For a Database whose files turn out to be bad only when samples are read: an error about one of
/// them becomes one that names all. Any thread may call it; the files are looked through once.
class BadSamples {
  public:
    /// Throws `first`, or BadFilesError when `check` (of a material, by its index, all its samples)
    /// throws InputError for several.
    [[noreturn]] void fail(const Database& database, const InputError& first,
                           const std::function<void(std::size_t)>& check);

  private:
    std::once_flag looked_;
    std::exception_ptr error_;
};

}  // namespace merl::engine
