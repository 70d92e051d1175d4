#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/majorants/kd_tree.h"
#include "media/majorants/octree.h"
#include "media/majorants/prescribed.h"
#include "media/majorants/ray_maximum.h"
#include "media/majorants/vdb_nodes.h"

namespace nullmark {

NULLMARK_REGISTER_MAJORANT(GlobalMajorantSource);
NULLMARK_REGISTER_MAJORANT(GridMajorantSource);
NULLMARK_REGISTER_MAJORANT(KdTreeSource);
NULLMARK_REGISTER_MAJORANT(OctreeSource);
NULLMARK_REGISTER_MAJORANT(PrescribedMajorantSource);
NULLMARK_REGISTER_MAJORANT(RayMaximumSource);
NULLMARK_REGISTER_MAJORANT(VdbNodesSource);

}  // namespace nullmark
