#include "shared/exit_codes.hpp"
