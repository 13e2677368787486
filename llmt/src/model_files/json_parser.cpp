#include "model_files/json_parser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "llmt/limits.hpp"

namespace llmt {
namespace {

std::string printable(std::string text, std::size_t most) {
  if (text.size() > most) text = text.substr(0, most) + "...";
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

// The message without the name that the library gives to the mistake: "[json.exception.parse_error.101] ".
std::string without_number(const std::string& message) {
  const std::size_t end = message.starts_with('[') ? message.find("] ") : std::string::npos;
  return end == std::string::npos ? message : message.substr(end + 2);
}

// Takes the values within a value away, the innermost first, so that none is destroyed that holds others. The parser
// bounds the depth.
void empty(Json& json) noexcept {
  if (json.is_array()) {
    auto& values = json.get_ref<Json::array_t&>();
    for (Json& value : values) empty(value);
    values.clear();
  } else if (json.is_object()) {
    auto& members = json.get_ref<Json::object_t&>();
    for (auto& [key, value] : members) empty(value);
    members.clear();
  }
}

// Puts the value together from the parser's events. The containers that are open are held in a list of their own, so
// depth costs no stack.
class Builder final : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& name, std::size_t most_values) : name_(name), most_values_(most_values) {}

  JsonDocument take() { return std::move(document_); }

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(Json::number_integer_t value) override { return put(value); }
  bool number_unsigned(Json::number_unsigned_t value) override { return put(value); }
  bool number_float(Json::number_float_t value, const std::string& /*text*/) override { return put(value); }
  bool string(std::string& value) override { return put(std::move(value)); }
  bool binary(Json::binary_t& /*value*/) override { return false; }  // there is none in JSON

  bool start_object(std::size_t /*elements*/) override { return open(Json::object()); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t /*elements*/) override { return open(Json::array()); }
  bool end_array() override { return close(); }

  bool key(std::string& key) override {
    const Json& object = *open_.back().container;
    open_.back().key = std::move(key);
    if (object.contains(open_.back().key)) fail("the member stands there twice");
    if (std::ssize(object) >= most(Limit::json_members))
      fail(fmt::format("an object has more than {} members", most(Limit::json_members)));
    return true;
  }

  bool parse_error(std::size_t /*position*/, const std::string& last_token,
                   const nlohmann::detail::exception& error) override {
    constexpr int number_overflow = 406;
    if (error.id == number_overflow) fail(fmt::format("{} is beyond the range of a double", quotable(last_token)));
    constexpr std::size_t enough = 300;
    throw std::runtime_error(fmt::format("{}: not JSON, or cut off: {}{}", name_,
                                         printable(without_number(error.what()), enough),
                                         open_.empty() ? "" : ", in " + pointer()));
  }

 private:
  struct Open {
    Json* container;
    std::string key;  // of an object's member that comes next
  };

  // Puts a value where the last events say.
  Json& add(Json value) {
    if (++values_ > most_values_) fail(fmt::format("more than {} values", most_values_));
    if (open_.empty()) return document_.value() = std::move(value);
    Json& container = *open_.back().container;
    if (container.is_object()) return container[open_.back().key] = std::move(value);
    container.push_back(std::move(value));
    return container.back();
  }

  bool put(Json value) {
    add(std::move(value));
    return true;
  }

  bool open(Json container) {
    if (std::ssize(open_) >= most(Limit::json_levels))
      fail(fmt::format("more than {} levels", most(Limit::json_levels)));
    open_.push_back({&add(std::move(container)), {}});
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  // The way to the value that is being read.
  std::string pointer() const {
    std::string way;
    for (std::size_t level = 0; level < open_.size(); ++level) {
      const Json& container = *open_[level].container;
      const bool is_last = level + 1 == open_.size();
      way += "/" + (container.is_object() ? quotable(open_[level].key)
                                          : fmt::format("{}", container.size() - (is_last ? 0 : 1)));
    }
    return way;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {}{}", name_, open_.empty() ? "" : pointer() + ": ", what));
  }

  const std::string& name_;
  std::size_t most_values_;
  std::size_t values_ = 0;
  JsonDocument document_;
  std::vector<Open> open_;
};

}  // namespace

JsonDocument::~JsonDocument() { empty(value_); }

JsonDocument parse_json(const std::string& text, const std::string& name, std::size_t most_values) {
  Builder builder(name, most_values);
  Json::sax_parse(text, &builder);
  return builder.take();
}

std::string quotable(const std::string& text) {
  constexpr std::size_t most = 40;
  return printable(text, most);
}

std::string quotable(const Json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return "an array";
  if (value.is_string()) return fmt::format("\"{}\"", quotable(value.get_ref<const std::string&>()));
  return value.dump();
}

}  // namespace llmt
