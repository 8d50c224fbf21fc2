// Writes the surfels around the robot as a point cloud: surfels_to_ply SOCKET OUT.ply [HALF_EDGE_M]. Of a box around
// the camera, all that the robot holds unless its half edge is given.
#include <comap_robot.hpp>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace {

comap_robot_box boxAround(const comap_robot_transform& centre, double half_m) {
  return {{centre.x - half_m, centre.y - half_m, centre.z - half_m},
          {centre.x + half_m, centre.y + half_m, centre.z + half_m}};
}

bool writePly(const char* path, const comap_robot_api::Surfels& answer) {
  std::FILE* file = std::fopen(path, "w");
  if (file == nullptr) return false;
  const auto surfels = answer.surfels();
  std::fprintf(file, "ply\nformat ascii 1.0\ncomment map %s snapshot %llu\nelement vertex %zu\n", answer.map().c_str(),
               static_cast<unsigned long long>(answer.snapshot()), surfels.size());
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "radius"}) std::fprintf(file, "property float %s\n", name);
  for (const char* name : {"red", "green", "blue", "confidence", "contributors"})
    std::fprintf(file, "property uchar %s\n", name);
  std::fprintf(file, "end_header\n");
  for (const comap_robot_surfel& s : surfels)
    std::fprintf(file, "%.9g %.9g %.9g %.9g %.9g %.9g %.9g %d %d %d %d %d\n", double(s.position_m[0]),
                 double(s.position_m[1]), double(s.position_m[2]), double(s.normal[0]), double(s.normal[1]),
                 double(s.normal[2]), double(s.radius_m), s.r, s.g, s.b, s.confidence, s.contributors);
  return std::fclose(file) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: surfels_to_ply SOCKET OUT.ply [HALF_EDGE_M]\n");
    return 2;
  }
  try {
    comap_robot_api::Robot robot(argv[1]);
    const auto pose = robot.waitPose(0, 5000);
    if (!pose) {
      std::fprintf(stderr, "surfels_to_ply: robot %s has no pose yet\n", robot.name().c_str());
      return 1;
    }
    const double half_m = argc > 3 ? std::atof(argv[3]) : std::numeric_limits<double>::infinity();
    const auto answer = robot.readSurfels(boxAround(pose->T_map_cam, half_m));
    if (!writePly(argv[2], *answer)) {
      std::fprintf(stderr, "surfels_to_ply: %s cannot be written\n", argv[2]);
      return 3;
    }
    std::printf("%zu surfels of %zu tiles, map %s, snapshot %llu\n", answer->surfels().size(), answer->tiles().size(),
                answer->map().c_str(), static_cast<unsigned long long>(answer->snapshot()));
  } catch (const comap_robot_api::Error& error) {
    std::fprintf(stderr, "surfels_to_ply: %s\n", error.what());
    return 3;
  }
}
