#pragma once

#include <span>

#include "client/firmware/link/file_descriptor.h"
#include "client/firmware/link/link.h"

namespace gatefield::firmware {

/// The rates that Linux names.
std::span<const int> baud_rates() noexcept;

/// Opens a serial port: raw bytes, 8N1, no flow control, non-blocking, for this process alone, with the driver's own
/// buffering off where it has any (a USB adapter waits 16 ms otherwise). What came before is dropped.
/// Errors: as open().
/// @pre address.kind == kSerial, address.baud is one of baud_rates()
Result<FileDescriptor> open_serial_port(const Address& address);

}  // namespace gatefield::firmware
