// A build without the page of the reports.
#include "report/document/page.hpp"

namespace llmt::report {

std::string_view empty_page() { return {}; }

}  // namespace llmt::report
