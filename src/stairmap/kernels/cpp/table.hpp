// A tabulated prediction: what evenly spaced slopes must see.
#pragma once

#include "arrays.hpp"
#include "section.hpp"

namespace stairmap {

class Table {
  public:
    explicit Table(nb::tuple arrays)
        : slope(array_of(arrays, 0), "table[0]"), value(array_of(arrays, 1), "table[1]"),
          by_slope(array_of(arrays, 2), "table[2]"), sensitivity(array_of(arrays, 3), "table[3]"),
          spread(array_of(arrays, 4), "table[4]"), farthest(array_of(arrays, 5), "table[5]") {
        const size_t count = slope.size();
        check_length(value, "table[1]", count);
        check_length(by_slope, "table[2]", count);
        check_length(sensitivity, "table[3]", count);
        check_length(spread, "table[4]", count);
        check_length(farthest, "table[5]", count);
        if (count == 0) refuse("table[0]: expected at least one ray, got none");
        spacing_ = count > 1 ? slope[1] - slope[0] : 1.0;
    }

    size_t size() const { return slope.size(); }

    TableView view() const {
        return {size(),          spacing_,           slope.data(),  value.data(),
                by_slope.data(), sensitivity.data(), spread.data(), farthest.data()};
    }
    size_t entry(double tau) const { return view().entry(tau); }
    double expected(double tau, size_t at) const { return view().expected(tau, at); }

    Input<double, 1> slope, value, by_slope, sensitivity, spread, farthest;

  private:
    static nb::handle array_of(const nb::tuple &arrays, size_t index) {
        if (arrays.size() != 6) refuse("table: expected six arrays, got " + std::to_string(arrays.size()));
        return nb::handle(PyTuple_GET_ITEM(arrays.ptr(), static_cast<Py_ssize_t>(index)));
    }

    double spacing_;
};

// Rays told by slope, bearing and inverse forward distance.
class Rays {
  public:
    explicit Rays(nb::tuple arrays)
        : slope(array_of(arrays, 0), "rays[0]"), bearing(array_of(arrays, 1), "rays[1]"),
          q(array_of(arrays, 2), "rays[2]") {
        check_length(bearing, "rays[1]", slope.size());
        check_length(q, "rays[2]", slope.size());
    }

    size_t size() const { return slope.size(); }
    RaysView view() const { return {slope.size(), slope.data(), bearing.data(), q.data()}; }

    Input<double, 1> slope, bearing, q;

  private:
    static nb::handle array_of(const nb::tuple &arrays, size_t index) {
        if (arrays.size() != 3) refuse("rays: expected three arrays, got " + std::to_string(arrays.size()));
        return nb::handle(PyTuple_GET_ITEM(arrays.ptr(), static_cast<Py_ssize_t>(index)));
    }
};

}  // namespace stairmap
