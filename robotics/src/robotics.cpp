#include "llmt/robotics/robotics.hpp"
