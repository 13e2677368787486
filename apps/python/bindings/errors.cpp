#include "python/bindings/errors.hpp"

#include <fmt/format.h>
#include <nanobind/nanobind.h>

#include <algorithm>
#include <exception>
#include <regex>
#include <stdexcept>
#include <string>

#include "llmt/option_fields.hpp"
#include "llmt/progress.hpp"
#include "python/bindings/options.hpp"

namespace llmt::python {
namespace {

// "<measured>:7" is row 5: a table in memory is written with its header on line 1.
std::string with_rows(const std::string& message) {
  static const std::regex place("<([A-Za-z_0-9]+)>(:([0-9]+))?");
  std::string text;
  auto rest = message.cbegin();
  for (std::sregex_iterator found(message.begin(), message.end(), place), end; found != end; ++found) {
    text.append(rest, message.cbegin() + found->position());
    text += (*found)[1];
    const long line = (*found)[3].matched ? std::stol((*found)[3]) : 0;
    if (line > 1) text += fmt::format(", row {}", line - 2);
    rest = message.cbegin() + found->position() + found->length();
  }
  return text.append(rest, message.cend());
}

std::string with_arguments(const std::string& message) {
  static const std::regex option("--([a-z][a-z0-9]*(-[a-z0-9]+)*)");
  std::string text;
  auto rest = message.cbegin();
  for (std::sregex_iterator found(message.begin(), message.end(), option), end; found != end; ++found) {
    text.append(rest, message.cbegin() + found->position());
    std::string name = (*found)[1];
    std::ranges::replace(name, '-', '_');
    text += name;
    rest = message.cbegin() + found->position() + found->length();
  }
  return text.append(rest, message.cend());
}

std::string in_words_of_python(const std::string& message) {
  static const std::regex function("llmt::[A-Za-z_:]+: ");
  return with_arguments(with_rows(std::regex_replace(message, function, "")));
}

void translate(const std::exception_ptr& thrown, void* /*payload*/) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Cancelled& error) {
    PyErr_SetString(PyExc_InterruptedError, error.what());
  } catch (const std::runtime_error& error) {
    PyErr_SetString(PyExc_ValueError, in_words_of_python(error.what()).c_str());
  } catch (const OptionRefused& error) {
    PyErr_SetString(PyExc_ValueError, (parameter_of(error.option()) + error.rest()).c_str());
  } catch (const std::invalid_argument& error) {
    PyErr_SetString(PyExc_ValueError, in_words_of_python(error.what()).c_str());
  }
}

}  // namespace

void write_or_raise(std::span<const NewFile> files) {
  try {
    const nanobind::gil_scoped_release unlocked;
    write_files(files);
  } catch (const std::runtime_error& error) {
    PyErr_SetString(PyExc_OSError, error.what());
    throw nanobind::python_error();
  }
}

void register_errors() { nanobind::register_exception_translator(translate); }

}  // namespace llmt::python
