#pragma once

namespace nullmark {

/// Puts /dev/null on those of the descriptors 0 to 2 that the caller has closed, so that no file that is opened later takes their
/// place and receives what is printed.  Using one of them still fails, as it did when it was closed.
void open_closed_descriptors();

}  // namespace nullmark
