#pragma once
#include <string>

/// An X server for the tests: the one there is, or an Xvfb of our own until the program ends. Empty if it can
/// be had; else why not.
std::string have_display();

#define NEED_DISPLAY()                                                          \
    if (const std::string why = have_display(); !why.empty()) {                 \
        GTEST_SKIP() << "no X server can be had (" << why << "); install xvfb"; \
    }
