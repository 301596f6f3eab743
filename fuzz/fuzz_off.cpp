#include "read_and_weld.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    return read_and_weld(data, size, innerspring::read_off);
}
