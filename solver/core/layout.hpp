/* A struct of views names its members once more, in the words of the Python tuple that fills it:
 *
 *     struct Pattern { CInts at, group; CIntMat runs, span; GUDGEON_FIELDS(at, group, runs, span) };
 *
 * `each` calls a function with the name and a reference of every member; `python/read.hpp` reads a tuple by it, and
 * compares shapes with those that the struct declares:
 *
 *     struct Pattern { GUDGEON_SHAPES("at p, group p, runs * 3, span * 2") ... };
 *
 * A letter is one size in all structs that are read together, `*` any, 2r+j a sum, c! is 1 + ... + c; with a last `?`
 * the array may be empty.
 */
#pragma once
#define GUDGEON_PARENS ()
#define GUDGEON_EXPAND(...) GUDGEON_E4(GUDGEON_E4(GUDGEON_E4(GUDGEON_E4(__VA_ARGS__))))
#define GUDGEON_E4(...) GUDGEON_E3(GUDGEON_E3(GUDGEON_E3(GUDGEON_E3(__VA_ARGS__))))
#define GUDGEON_E3(...) GUDGEON_E2(GUDGEON_E2(GUDGEON_E2(GUDGEON_E2(__VA_ARGS__))))
#define GUDGEON_E2(...) GUDGEON_E1(GUDGEON_E1(GUDGEON_E1(GUDGEON_E1(__VA_ARGS__))))
#define GUDGEON_E1(...) __VA_ARGS__
#define GUDGEON_ONE(name, ...) f(#name, name); __VA_OPT__(GUDGEON_AGAIN GUDGEON_PARENS(__VA_ARGS__))
#define GUDGEON_AGAIN() GUDGEON_ONE
#define GUDGEON_FIELDS(...)                                  \
    template <class F> void each(F&& f) {                    \
        GUDGEON_EXPAND(GUDGEON_ONE(__VA_ARGS__))             \
    }
#define GUDGEON_SHAPES(text) static constexpr const char* shapes = text;
