"""What tests/study.hpp is for the tests in C++: the gate takes a part of what `ctest --preset studies` takes whole."""

import os


def sampled(whole, few):
    return whole if "LLMT_STUDIES" in os.environ else few
