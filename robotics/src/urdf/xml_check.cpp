#include "urdf/xml_check.hpp"

#include <expat.h>
#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <string_view>

#include "llmt/limits.hpp"

namespace llmt::robotics {
namespace {

// Counts what expat meets. Nothing is thrown through expat: the first reason stops it.
struct Census {
  XML_Parser parser;
  int depth = 0;
  int nodes = 0;
  int links = 0;
  std::string reason;

  void stop(std::string why) {
    if (!reason.empty()) return;
    reason = std::move(why);
    XML_StopParser(parser, XML_FALSE);
  }
  void count() {
    if (++nodes > most(Limit::urdf_nodes))
      stop(fmt::format("there are more than {} elements and comments", most(Limit::urdf_nodes)));
  }
};

Census& of(void* data) { return *static_cast<Census*>(data); }

void begin_element(void* data, const XML_Char* name, const XML_Char** attributes) {
  Census& census = of(data);
  census.count();
  if (++census.depth > most(Limit::urdf_levels))
    census.stop(fmt::format("elements are nested deeper than {}", most(Limit::urdf_levels)));
  constexpr int level_of_links = 2;
  const bool is_link = census.depth == level_of_links && std::string_view(name) == "link";
  if (is_link && ++census.links > most(Limit::urdf_links)) {  // urdfdom destroys links of a chain within each other
    census.stop(fmt::format("there are more than {} links", most(Limit::urdf_links)));
  }
  constexpr std::int64_t most_attributes = most(Limit::urdf_attributes);
  int texts = 0;  // name, value, name, value, ..., null
  while (texts <= 2 * most_attributes && attributes[texts] != nullptr) ++texts;
  if (texts > 2 * most_attributes) census.stop(fmt::format("an element has more than {} attributes", most_attributes));
}

void end_element(void* data, const XML_Char*) { --of(data).depth; }

void comment(void* data, const XML_Char*) { of(data).count(); }

void begin_cdata(void* data) { of(data).count(); }

void instruction(void* data, const XML_Char*, const XML_Char* text) {
  of(data).count();
  if (std::string_view(text).find_first_of("<>") != std::string_view::npos) {
    of(data).stop("a processing instruction holds < or >");  // TinyXML would take what follows for elements
  }
}

void begin_document_type(void* data, const XML_Char*, const XML_Char*, const XML_Char*, int) {
  of(data).stop("a document type and entities are not for a URDF");
}

}  // namespace

void check_xml(const std::string& text, const std::string& name) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw std::runtime_error(fmt::format("{}: this is UTF-16, UTF-8 is needed", name));
  }
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("UTF-8"), XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  Census census{.parser = parser.get(), .reason = {}};
  XML_SetUserData(parser.get(), &census);
  XML_SetElementHandler(parser.get(), begin_element, end_element);
  XML_SetCommentHandler(parser.get(), comment);
  XML_SetCdataSectionHandler(parser.get(), begin_cdata, nullptr);
  XML_SetProcessingInstructionHandler(parser.get(), instruction);
  XML_SetStartDoctypeDeclHandler(parser.get(), begin_document_type);
  if (XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), XML_TRUE) == XML_STATUS_OK) return;
  const XML_Error error = XML_GetErrorCode(parser.get());
  if (error == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
  throw std::runtime_error(fmt::format("{}:{}:{}: {}", name, XML_GetCurrentLineNumber(parser.get()),
                                       XML_GetCurrentColumnNumber(parser.get()) + 1,
                                       census.reason.empty() ? XML_ErrorString(error) : census.reason));
}

}  // namespace llmt::robotics
