#pragma once
// What the tests of the readers share.
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/read.h"

namespace innerspring::testing {

inline std::string message_of(std::string_view bytes, std::string_view name) {
    try {
        read_from_memory(bytes, name);
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

template <class T>
std::string raw(T value, bool big_endian = false) {
    std::string out(sizeof value, '\0');
    std::memcpy(out.data(), &value, sizeof value);
    return big_endian ? std::string(out.rbegin(), out.rend()) : out;
}

/// A square: its corners as OBJ, and what a polygon through them becomes.
inline const std::string four_corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
inline const std::vector<Triangle> fan_of_four = {{0, 1, 2}, {0, 2, 3}};

}  // namespace innerspring::testing

#define EXPECT_MESSAGE(bytes, name, fragment)                                                  \
    EXPECT_NE(innerspring::testing::message_of(bytes, name).find(fragment), std::string::npos) \
        << "message: " << innerspring::testing::message_of(bytes, name) << "\nwithout: " << (fragment)
