#include "report/document/document.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

namespace llmt::report {
namespace {

double rounded(double value) {
  const std::string text = fmt::format("{:.6g}", value);
  double result = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(rounded(value)) : Json(nullptr); }

Json axis(const Axis& from) {
  Json json = {{"title", from.title}};
  if (from.log) json["log"] = true;
  if (!from.categories.empty()) json["categories"] = from.categories;
  if (from.range) json["range"] = numbers({from.range->first, from.range->second});
  return json;
}

const char* name_of(Mark mark) {
  switch (mark) {
    case Mark::points:
      return "points";
    case Mark::line:
      return "line";
    case Mark::bars:
      return "bars";
    case Mark::band:
      return "band";
  }
  return "";
}

Json layer(const Layer& from) {
  Json json = {{"mark", name_of(from.mark)}, {"name", from.name}, {"role", from.role}, {"x", numbers(from.x)}};
  for (const auto& [key, values] :
       {std::pair{"y", &from.y}, {"low", &from.low}, {"high", &from.high}, {"base", &from.base}}) {
    if (!values->empty()) json[key] = numbers(*values);
  }
  if (from.size > 0) json["size"] = from.size;
  if (!from.labels.empty()) json["labels"] = from.labels;
  if (!from.roles.empty()) json["roles"] = from.roles;
  for (const auto& [key, value] :
       {std::pair{"dash", from.dashed}, {"steps", from.steps}, {"horizontal", from.horizontal}}) {
    if (value) json[key] = true;
  }
  return json;
}

Json rows_of(const Eigen::MatrixXd& values) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < values.rows(); ++i) rows.push_back(numbers(numbers_of(values.row(i).transpose())));
  return rows;
}

// All that stands between the answer and the first picture, as one paragraph.
std::string lead_of(const Document& document) {
  std::vector<std::string> sentences = {document.subject, document.lead};
  sentences.insert(sentences.end(), document.notes.begin(), document.notes.end());
  std::string text;
  for (const std::string& sentence : sentences) {
    if (sentence.empty()) continue;
    text += (text.empty() ? "" : " ") + sentence +
            (std::string_view(".?!").find(sentence.back()) != std::string_view::npos ? "" : ".");
  }
  return text;
}

template <typename Block>
Json heading(const char* kind, const Block& from) {
  Json json = {{"kind", kind}, {"title", from.title}};
  if (!from.caption.empty()) json["caption"] = from.caption;
  return json;
}

}  // namespace

Json numbers(const Numbers& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(number_or_null(value));
  return json;
}

Numbers numbers_of(const Eigen::Ref<const Eigen::VectorXd>& values) { return {values.begin(), values.end()}; }

Json block(const Chart& chart) {
  Json json = heading("chart", chart);
  json["x"] = axis(chart.x);
  json["y"] = axis(chart.y);
  json["layers"] = Json::array();
  for (const Layer& each : chart.layers) json["layers"].push_back(layer(each));
  for (const Reference& line : chart.references) {
    json["refs"].push_back({{"axis", line.vertical ? "x" : "y"},
                            {"value", number_or_null(line.value)},
                            {"name", line.name},
                            {"role", line.role}});
  }
  json["equal"] = chart.equal;
  json["overlay"] = chart.overlay;
  json["wide"] = chart.wide;
  return json;
}

Json block(const Map& map) {
  Json json = heading("map", map);
  json["x"] = axis(map.x);
  json["y"] = axis(map.y);
  json["xs"] = numbers(map.xs);
  json["ys"] = numbers(map.ys);
  json["z"] = rows_of(map.z);
  json["unit"] = map.unit;
  json["diverging"] = map.diverging;
  if (map.limit > 0.0) json["limit"] = rounded(map.limit);
  for (const Map::Box& box : map.boxes) {
    json["boxes"].push_back({{"x0", box.x0}, {"x1", box.x1}, {"y0", box.y0}, {"y1", box.y1}, {"label", box.label}});
  }
  if (!map.points_x.empty()) json["points"] = {{"x", numbers(map.points_x)}, {"y", numbers(map.points_y)}};
  json["equal"] = map.equal;
  json["cells"] = map.cells;
  json["reversed"] = map.reversed;
  json["wide"] = map.wide;
  return json;
}

Json block(const Surface& surface) {
  Json json = heading("surface", surface);
  json["x"] = axis(surface.x);
  json["y"] = axis(surface.y);
  json["z_axis"] = axis(surface.z_axis);
  json["xs"] = numbers(surface.xs);
  json["ys"] = numbers(surface.ys);
  json["z"] = rows_of(surface.z);
  if (surface.points.rows() > 0) {
    json["points"] = {{"x", numbers(numbers_of(surface.points.col(0)))},
                      {"y", numbers(numbers_of(surface.points.col(1)))},
                      {"z", numbers(numbers_of(surface.points.col(2)))}};
  }
  json["wide"] = surface.wide;
  return json;
}

Json block(const Arm& arm) {
  Json json = heading("arm", arm);
  json["x"] = {{"title", "x, mm"}};
  json["y"] = {{"title", "y, mm"}};
  json["z_axis"] = {{"title", "z, mm"}};
  json["robots"] = {{{"name", ""}, {"role", "muted"}, {"path", rows_of(arm.path)}}};
  json["points"] = {{"name", "measured points"}, {"role", "data"}, {"at", rows_of(arm.points)}};
  json["arrows"] = {
      {{"name", arm.arrows}, {"role", arm.role}, {"from", rows_of(arm.points)}, {"to", rows_of(arm.tips)}}};
  return json;
}

Json block(const Grid& grid) {
  Json json = heading("table", grid);
  json["header"] = grid.header;
  json["rows"] = grid.rows;
  json["words"] = grid.words;
  json["marked"] = grid.marked;
  json["wide"] = grid.wide;
  return json;
}

Json text_block(const std::string& title, const std::vector<std::string>& lines) {
  return {{"kind", "text"}, {"title", title}, {"lines", lines}};
}

Json or_table(Json picture, const Grid& table) {
  picture["in_words"] = block(table);
  return picture;
}

Json to_json(const Document& document) {
  Json json = {{"title", document.title}, {"answer", document.answer}, {"lead", lead_of(document)}};
  json["sections"] = Json::array();
  const auto add = [&](const Section& section) {
    if (section.blocks.empty()) return;
    json["sections"].push_back({{"title", section.title}, {"text", section.text}, {"blocks", section.blocks}});
  };
  Section first;
  if (document.main) first.blocks.push_back(block(*document.main));
  first.blocks.insert(first.blocks.end(), document.beside_main.begin(), document.beside_main.end());
  add(first);
  for (const Section& section : document.sections) add(section);
  return json;
}

}  // namespace llmt::report
