/* Which ports share a body, and searches among them.
 *
 * Ports that follow each other on the same bodies are a group. Row j of a table holds what port j does to the ports of
 * all groups that share a body with its own, in the order of their numbers, as a few runs of ports that follow each
 * other: ports of bodies that are apart do not couple, and take no room. `Pattern`, `between` and `combine_rows` stand
 * in compliance.hpp.
 */
#pragma once
#include "../response/compliance.hpp"

namespace gudgeon {

/* Place of the first of `size` ascending numbers that is not below `least`. */
inline Index first_from(CInts numbers, Index size, Index least) noexcept {
    Index low = 0, high = size;
    while (low < high) {
        const Index middle = (low + high) / 2;
        if (numbers[middle] < least)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

}  // namespace gudgeon
