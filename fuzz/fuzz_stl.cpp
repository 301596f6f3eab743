#include "read_and_weld.h"

// Both encodings, and the choice between them, see every input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    read_and_weld(data, size, innerspring::read_stl_text);
    read_and_weld(data, size, innerspring::read_stl_binary);
    return read_and_weld(data, size, innerspring::read_from_memory);
}
