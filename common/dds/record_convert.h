#pragma once

#include "common/protocol/pilot_record.h"
#include "gatefield_idl/servers.h"

/// Wire <-> domain for what servers say to each other; inside common/dds only. As convert.h has it for the rest.
namespace gatefield::dds {

/// All but `to`, which is the endpoint's.
void to_wire(const protocol::PilotRecord& in, wire::PilotRecord* out);
Status from_wire(const wire::PilotRecord& in, protocol::PilotRecord* out);

}  // namespace gatefield::dds
