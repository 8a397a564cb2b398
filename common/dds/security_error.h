#pragma once

#include "common/base/result.h"

namespace gatefield::dds {

/// Whether a failure is about what NetworkOptions::security names: a person has to mend it, and nothing was sent.
inline bool is_about_security(const Error& error) { return error.field == "network.security"; }

}  // namespace gatefield::dds
