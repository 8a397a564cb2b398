#pragma once

#include <vector>

namespace gatefield::training {

/// Everything here gives NaN where there is nothing to say something about.

double mean(const std::vector<double>& values);

/// Spearman's rank correlation, -1 to 1; equal values share the mean of their ranks. @pre a.size() == b.size(), no NaN
double spearman(const std::vector<double>& a, const std::vector<double>& b);

/// Mean |truth - constant| with the best constant there is, the median.
double constant_error(std::vector<float> truth);
/// Percent of the values that have the sign which most of them have.
double constant_sign_percent(const std::vector<float>& truth);

}  // namespace gatefield::training
