// A build without the page of the reports.
#include "report/page.hpp"

namespace llmt::apps::report {

std::string_view empty_page() { return {}; }

}  // namespace llmt::apps::report
