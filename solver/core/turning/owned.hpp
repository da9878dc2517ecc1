/* Arrays that a loop owns: made once before it runs, shown by views. */
#pragma once
#include <algorithm>
#include <array>
#include <memory>
#include <tuple>
#include <type_traits>
#include <vector>

#include "../view.hpp"

namespace gudgeon {

class Arrays {
public:
    /* A view of zeros of a shape. */
    template <class V, class... Sizes>
    V make(Sizes... sizes) {
        using Item = std::remove_const_t<typename V::Item>;
        static_assert(sizeof...(Sizes) == V::dimensions && std::is_trivially_destructible_v<Item>);
        const Index count = (Index(1) * ... * Index(sizes));
        auto& block = blocks_.emplace_back(std::make_unique<double[]>(std::size_t(count) * sizeof(Item) / sizeof(double) + 1));
        return V{reinterpret_cast<Item*>(block.get()), {Index(sizes)...}};
    }

    /* A view of a copy. */
    template <class T, int N>
    View<std::remove_const_t<T>, N> copy_of(View<T, N> source) {
        return std::apply(
            [&](auto... sizes) {
                const auto target = make<View<std::remove_const_t<T>, N>>(sizes...);
                std::copy_n(source.data, (Index(1) * ... * sizes), target.data);
                return target;
            },
            std::to_array(source.shape));
    }

private:
    std::vector<std::unique_ptr<double[]>> blocks_;
};

}  // namespace gudgeon
