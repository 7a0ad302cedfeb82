#pragma once

namespace merl::engine {

/// A sum of which no addition loses anything but what is of second order (Knuth's two-sum; Neumaier
/// 1974). The same bits for the same numbers in the same order.
class CompensatedSum {
  public:
    void add(double number) {
        const double sum = sum_ + number;
        const double added = sum - sum_;
        rest_ += (sum_ - (sum - added)) + (number - added);
        sum_ = sum;
    }

    double total() const { return sum_ + rest_; }

  private:
    double sum_ = 0;
    double rest_ = 0;  // what was lost
};

}  // namespace merl::engine
