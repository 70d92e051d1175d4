#pragma once

#include <memory>
#include <vector>

#include "harness/kernel/transport_scene.h"
#include "harness/sampling/scene.h"

namespace nullmark {

/// Builds surfaces with radiances of `channels` channels.  Throws ParameterError.
std::vector<Surface> build_surfaces(const std::vector<SurfaceSpec>& specs, int channels);

/// The rays, cut at the first surface they meet.
BuiltRays cut_at(const std::vector<Surface>& surfaces, BuiltRays rays);

/// Builds the scene of a specification.  Throws ParameterError if its parts do not fit the medium, MissingData if the file of an
/// emission field is missing.
TransportScene make_transport_scene(const MediumSpec& medium, const BuiltMedium& built,
                                    std::shared_ptr<const MajorantStructure> majorant, const TransportSpec& transport);

}  // namespace nullmark
