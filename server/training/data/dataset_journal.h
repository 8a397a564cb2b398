#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "server/training/data/dataset_layout.h"

/// The copy of a file's structure while it is enlarged: libhdf5 changes several places of it one after another, so that
/// a process that is killed meanwhile would leave a file that nobody can open. All bytes that are no sample lie in the
/// journal before it begins and are put back when it was not finished. Not for use outside of this folder.
/// Thread-safe: no; the caller holds the file's lock.
namespace gatefield::training {

/// <file>.journal
std::filesystem::path journal_of(const std::filesystem::path& file);
/// Makes the journal, whole or not at all. @param descriptor  of the file, to read
Status write_journal(const std::filesystem::path& file, int descriptor, const DatasetLayout& layout);
/// Puts back what an enlargement that was cut short may have left half changed; does nothing without a journal.
/// @param descriptor  of the file, to write
Status apply_journal(const std::filesystem::path& file, int descriptor);

}  // namespace gatefield::training
