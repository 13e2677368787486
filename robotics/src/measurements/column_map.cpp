#include "llmt/files.hpp"
#include "llmt/robotics/measurements.hpp"
#include "llmt/robotics/orientation.hpp"
#include "yaml/yaml_reader.hpp"

namespace llmt::robotics {

ColumnMap parse_column_map(const std::string& text, const std::string& name) {
  YamlMap map(parse_yaml(text, name), name, "");
  ColumnMap columns;
  if (map.has("decimal")) {
    const std::string decimal = map.text("decimal");
    if (decimal != "comma" && decimal != "point") map.refuse("decimal", "\"decimal\" must be comma or point");
    columns.decimal = decimal == "comma" ? DecimalMark::comma : DecimalMark::point;
  }
  columns.orientation = map.text_or("orientation", "");
  if (!columns.orientation.empty() && !is_orientation(columns.orientation)) {
    map.refuse("orientation", "\"orientation\" must be intrinsic_ or extrinsic_ and three axes, as intrinsic_xyz");
  }
  YamlMap names = map.map("columns");
  for (const std::string& column : names.keys()) columns.names[column] = names.text(column);
  map.finish({"decimal", "orientation", "columns"});
  return columns;
}

ColumnMap read_column_map(const std::string& path) {
  return parse_column_map(read_file(path, description_limit), path);
}

}  // namespace llmt::robotics
