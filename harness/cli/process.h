#pragma once

namespace nullmark {

/// Puts /dev/null on those of the descriptors 0 to 2 that the caller has closed, so that no file that is opened later takes their
/// place and receives what is printed.  Using one of them still fails, as it did when it was closed.
void open_closed_descriptors();

/// Has freed memory go back to the system early, so that a run of many cells holds little more than their records.
void return_freed_memory();

/// Has writes beyond the limit on the size of files fail as those to a full disk do, instead of ending the program.
void report_files_that_grow_too_large();

/// Has a crash print one line with the signal and the cell under way before the system deals with it.
void tell_of_crashes();

/// Throws InputError unless work on so many threads (0: all cores) can start them: TBB ends the program where it cannot.
void expect_threads(int threads);

}  // namespace nullmark
