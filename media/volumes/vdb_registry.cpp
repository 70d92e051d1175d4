#include "media/volumes/volume.h"

namespace nullmark {

NULLMARK_REGISTER_MEDIUM(VdbSource);

}  // namespace nullmark
