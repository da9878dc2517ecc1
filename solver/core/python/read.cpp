/* What reads arrays and numbers of Python, once for all types of views. */
#include "read.hpp"

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

}  // namespace

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
