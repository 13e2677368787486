/// \file
/// What a report shows, as plain data: sections of blocks. The page's script (page/) draws them in a browser, gnuplot
/// the chart that stands for the whole (plot.hpp), and document_text.hpp writes its words and tables for a terminal.
/// None of them knows a command.
///
/// A name of a colour is a role, not a colour: data, model, before, after, muted, floor, bad, up, down.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "report/text/json.hpp"

namespace llmt::report {

using Numbers = std::vector<double>;

/// The numbers with six significant digits, which no picture shows more of; NaN and infinity as null.
Json numbers(const Numbers& values);
Numbers numbers_of(const Eigen::Ref<const Eigen::VectorXd>& values);

struct Axis {
  std::string title = {};  ///< with the unit: "error, mm"
  bool log = false;
  std::vector<std::string> categories = {};             ///< names of the places 0, 1, 2, ...
  std::optional<std::pair<double, double>> range = {};  ///< from where to where; empty: by the data
};

enum class Mark { points, line, bars, band };

/// One set of data in a chart.
struct Layer {
  Mark mark = Mark::points;
  std::string name = {};  ///< in the legend; empty: not there
  std::string role = "data";
  Numbers x = {};
  Numbers y = {};
  Numbers low = {};                      ///< of a band, or the lower end of the bars' errors
  Numbers high = {};                     ///< the upper end
  Numbers base = {};                     ///< where bars begin; empty: at 0
  std::vector<std::string> labels = {};  ///< at the ends of bars
  std::vector<std::string> roles = {};   ///< of each bar; empty: all have `role`
  int size = 0;                          ///< of points, or the width of a line, in pixels; 0: by their number, usual
  bool dashed = false;
  bool steps = false;
  bool horizontal = false;  ///< bars: x is the place, y the length
};

/// A dotted line across a chart.
struct Reference {
  bool vertical = false;
  double value = 0.0;
  std::string name = {};
  std::string role = "floor";
};

struct Chart {
  std::string title;
  std::string caption = {};
  Axis x;
  Axis y;
  std::vector<Layer> layers;
  std::vector<Reference> references = {};
  bool equal = false;    ///< both axes in the same scale
  bool overlay = false;  ///< bars of several layers over each other, as histograms are
  bool wide = false;     ///< over the whole width of the page
};
Json block(const Chart& chart);

/// Values over a plane. `z` has a row for each of `ys` and a column for each of `xs`.
struct Map {
  struct Box {
    double x0, x1, y0, y1;
    std::string label;
  };
  std::string title;
  std::string caption = {};
  Axis x;
  Axis y;
  Numbers xs;
  Numbers ys;
  Eigen::MatrixXd z;
  std::string unit = {};
  bool diverging = false;  ///< colours on both sides of 0
  double limit = 0.0;      ///< the value of the last colour, for maps to be compared; 0: the largest
  std::vector<Box> boxes = {};
  Numbers points_x = {};
  Numbers points_y = {};
  bool equal = false;
  bool cells = false;     ///< gaps between the cells
  bool reversed = false;  ///< the first row on top
  bool wide = false;
};
Json block(const Map& map);

/// The same as a surface in space, with points about it.
struct Surface {
  std::string title;
  std::string caption = {};
  Axis x;
  Axis y;
  Axis z_axis;
  Numbers xs;
  Numbers ys;
  Eigen::MatrixXd z;
  Eigen::MatrixXd points = {};  ///< points x 3
  bool wide = false;
};
Json block(const Surface& surface);

/// An arm in space: lines along its links, the measured points, and arrows at them.
struct Arm {
  std::string title;
  std::string caption = {};
  Eigen::MatrixXd path;    ///< points along the links x 3, mm
  Eigen::MatrixXd points;  ///< n x 3, mm
  Eigen::MatrixXd tips;    ///< n x 3: where the arrow of each point ends
  std::string arrows = {};
  std::string role = "before";
};
Json block(const Arm& arm);

struct Grid {
  std::string title = {};
  std::string caption = {};
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<int> words = {};  ///< columns of words; the first always is one
  int marked = -1;              ///< the row to look at
  bool wide = false;
};
Json block(const Grid& grid);

/// Sentences. A terminal indents those below a title.
Json text_block(const std::string& title, const std::vector<std::string>& lines);

/// The picture, and the table that a terminal shows in its place.
Json or_table(Json picture, const Grid& table);

struct Section {
  std::string title;      ///< on the page; a terminal has the titles of blocks alone
  std::string text = {};  ///< a terminal shows it if there are words or tables among the blocks
  std::vector<Json> blocks = {};
};

struct Document {
  std::string title;                    ///< what was done with what: "llmt fit concrete.csv"
  std::string subject = {};             ///< what was read: "concrete.csv: 1030 rows of 8 inputs"
  std::string answer;                   ///< the answer in one sentence
  std::string lead = {};                ///< one or two more
  std::vector<std::string> notes = {};  ///< sentences to be read before anything below is believed
  std::optional<Chart> main = {};
  std::optional<Chart> importance = {};  ///< a picture of its own beside that of `main`; in pages it is in beside_main
  std::vector<Json> beside_main = {};
  std::vector<Section> sections = {};
};
Json to_json(const Document& document);

}  // namespace llmt::report
