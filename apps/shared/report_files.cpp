#include "shared/report_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "llmt/files.hpp"
#include "report/document/page.hpp"
#include "shared/options.hpp"
#include "shared/plot.hpp"

namespace llmt::apps {
namespace {

// Throws std::runtime_error in a build without the page of the reports, saying how to get one with it.
void require_page() {
  if (!report::empty_page().empty()) return;
  throw std::runtime_error(
      "--report: this program was built without reports. `cmake/setup report` fetches what they are drawn with and "
      "builds anew (it needs npm); --plot FILE.svg writes the main picture without it");
}

}  // namespace

void add_report_options(CLI::App& command, ReportFiles& files, const std::string& main_picture) {
  add_output_file(command, "--report", files.page, "Write a report with pictures: one HTML file that needs no network")
      ->check([](const std::string&) {
        require_page();
        return std::string();
      });
  add_output_file(command, "--plot", files.plot,
                  "Write the main picture, " + main_picture + ", as FILE.svg or FILE.png (needs gnuplot)")
      ->check([](const std::string& path) {
        plot_format(path);
        require_gnuplot();
        return std::string();
      });
}

std::string write_reports(const ReportFiles& files, const report::Document& document) {
  std::string text;
  if (!files.page.empty()) {
    const std::string origin = fmt::format("{}. Made by LLMT {}.", document.title, LLMT_VERSION);
    write_file(files.page, report::filled_page(report::empty_page(), document, origin));
    text += fmt::format("Report written to {}\n", files.page);
  }
  if (!files.plot.empty()) {
    write_plot(files.plot, document.main.value());
    text += fmt::format("Picture written to {}\n", files.plot);
    if (document.importance) {
      const std::string extension = std::filesystem::path(files.plot).extension().string();
      const std::string second = beside(files.plot, ".importance" + extension).string();
      write_plot(second, *document.importance);
      text += fmt::format("Picture written to {}\n", second);
    }
  }
  return text;
}

}  // namespace llmt::apps
