/* What reads arrays and numbers of Python, once for all types of views. */
#include "read.hpp"

#include <algorithm>

namespace gudgeon {

namespace {

/* Whether an object is an array that fits; sets the pointer and the shape of its view. */
template <class A>
bool shows(nb::handle value, const Target& target) {
    A array;
    if (!nb::try_cast(value, array, false) || array.dtype() != target.type || int(array.ndim()) != target.rank)
        return false;
    target.data = array.data();
    for (int k = 0; k < target.rank; ++k) target.shape[k] = Index(array.shape(std::size_t(k)));
    return true;
}

template <class N>
void read_number(const std::string& name, nb::handle value, N& number, const char* expected) {
    if (!nb::try_cast(value, number)) refuse(name, expected);
}

/* Take what stands before a sign off a text. */
std::string_view next(std::string_view& text, char sign) {
    const std::size_t length = std::min(text.find(sign), text.size());
    const std::string_view word = text.substr(0, length);
    text.remove_prefix(std::min(length + 1, text.size()));
    return word;
}

std::string shape_text(const Index* shape, int rank) {
    std::string text = "(";
    for (int k = 0; k < rank; ++k) text += (k ? ", " : "") + std::to_string(shape[k]);
    return text + (rank == 1 ? ",)" : ")");
}

}  // namespace

const Sizes::Size* Sizes::known(std::string_view letter) const noexcept {
    for (const Size& size : sizes_)
        if (size.letter == letter) return &size;
    return nullptr;
}

/* Whether a size is a sum such as 2r+j+1; a letter of it that is not known yet becomes known. */
bool Sizes::agrees(const std::string& name, std::string_view sum, Index size) {
    Index total = 0, factor = 0;
    std::string_view unknown;
    while (!sum.empty()) {
        std::string_view letter = next(sum, '+');
        Index count = 0;
        const std::size_t digits = std::min(letter.find_first_not_of("0123456789"), letter.size());
        for (const char digit : letter.substr(0, digits)) count = 10 * count + (digit - '0');
        letter.remove_prefix(digits);
        if (digits == 0) count = 1;
        const bool triangle = !letter.empty() && letter.back() == '!';
        if (triangle) letter.remove_suffix(1);
        if (letter.empty()) {
            total += count;
        } else if (const Size* found = known(letter)) {
            total += count * (triangle ? found->value * (found->value + 1) / 2 : found->value);
        } else {
            unknown = letter, factor = count;
        }
    }
    if (unknown.empty()) return size == total;
    if (size < total || (size - total) % factor != 0) return false;
    sizes_.push_back({std::string(unknown), (size - total) / factor, name});
    return true;
}

void Sizes::compare(const std::string& name, std::string_view declared, const Index* shape, int rank) {
    const bool empty = std::find(shape, shape + rank, 0) != shape + rank;
    if (empty && !declared.empty() && declared.back() == '?') return;
    std::string_view words = declared;
    bool right = true;
    for (int k = 0; k < rank && right; ++k) {
        const std::string_view sum = next(words, ' ');
        right = sum == "*" || agrees(name, sum, shape[k]);
    }
    if (right) return;
    std::string text = name + ": shape " + shape_text(shape, rank) + " is not (" + std::string(declared) + ")";
    for (const Size& size : sizes_)
        if (declared.find(size.letter) != std::string_view::npos)
            text += ", " + size.letter + " = " + std::to_string(size.value) + " of " + size.source;
    throw nb::value_error(text.c_str());
}

/* In the checked build, until the shapes of all scenes were compared: one that is too strict refuses a scene. */
void Sizes::compare(const std::string& name, std::string_view shapes, std::string_view member, const Index* shape,
                    int rank) {
#ifndef GUDGEON_CHECKED
    shapes = {};
#endif
    while (!shapes.empty()) {
        std::string_view declared = next(shapes, ',');
        if (!declared.empty() && declared.front() == ' ') declared.remove_prefix(1);
        if (next(declared, ' ') == member) return compare(name, declared, shape, rank);
    }
}

void refuse(const std::string& name, const char* expected) {
    throw nb::type_error((name + ": not " + expected).c_str());
}

void read_view(const std::string& name, nb::handle value, Target target) {
    using Written = nb::ndarray<nb::c_contig, nb::device::cpu>;
    using Shown = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
    if (!(target.written ? shows<Written>(value, target) : shows<Shown>(value, target)))
        refuse(name, "a contiguous array of this type and rank, writable where the loop writes");
}

void read(const std::string& name, nb::handle value, double& number) { read_number(name, value, number, "a number"); }

void read(const std::string& name, nb::handle value, Index& number) { read_number(name, value, number, "an integer"); }

void read(const std::string& name, nb::handle value, bool& flag) { read_number(name, value, flag, "True or False"); }

}  // namespace gudgeon
