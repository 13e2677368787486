/// \file
/// A chart as a picture file, drawn by gnuplot.
#pragma once

#include <string>

#include "report/document/document.hpp"

namespace llmt::apps {

/// What gnuplot is told, for output as "svg" or "png". No text of the chart can be more than text there.
std::string gnuplot_script(const report::Chart& chart, const std::string& format);

/// "svg" or "png", by the extension of the path. Throws std::invalid_argument for another one.
std::string plot_format(const std::string& path);

/// Throws std::runtime_error that names the package if there is no gnuplot.
void require_gnuplot();

/// Writes the picture. Throws std::runtime_error if gnuplot refuses or the file cannot be written.
void write_plot(const std::string& path, const report::Chart& chart);

}  // namespace llmt::apps
