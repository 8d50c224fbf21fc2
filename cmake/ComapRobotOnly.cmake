# The robot's program with all that it stands on, and tests of its odometry, messages and outbox: for other processors
# than the one that builds. The compilers of .proto files are the building machine's. scripts/check-arm64 is its user.
foreach(room protocol mapping_core/rgbd mapping_core/ferns robot_api edge_agent)
  add_subdirectory(${room})
endforeach()
foreach(room scenes protocol/types protocol/codec mapping_core/rgbd mapping_core/ferns edge_agent/odometry
             edge_agent/keyframes edge_agent/uplink)
  add_subdirectory(tests/${room})
endforeach()
