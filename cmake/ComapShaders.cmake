# Compute shaders into C arrays: shaders/fuse.comp becomes "shaders/fuse.h" with kFuseSpirv, in a library comap_<name>.
find_program(SPIRV_VAL spirv-val REQUIRED)

function(comap_shaders name)
  cmake_parse_arguments(ARG "" "" "SOURCES" ${ARGN})
  set(out ${PROJECT_BINARY_DIR}/generated/shaders)
  file(MAKE_DIRECTORY ${out})
  foreach(source ${ARG_SOURCES})
    get_filename_component(stem ${source} NAME_WE)
    string(REPLACE "_" ";" words ${stem})
    set(variable k)
    foreach(word ${words})
      string(SUBSTRING ${word} 0 1 first)
      string(SUBSTRING ${word} 1 -1 rest)
      string(TOUPPER ${first} first)
      string(APPEND variable ${first}${rest})
    endforeach()
    set(common ${PROJECT_SOURCE_DIR}/shaders/${source})
    set(flags -V --target-env vulkan1.1 -g0 --quiet -I${PROJECT_SOURCE_DIR}/shaders)
    add_custom_command(
      OUTPUT ${out}/${stem}.spv ${out}/${stem}.h  # the depfile is about the first
      COMMAND Vulkan::glslangValidator ${flags} --depfile ${out}/${stem}.d -o ${out}/${stem}.spv ${common}
      COMMAND ${SPIRV_VAL} --target-env vulkan1.1 ${out}/${stem}.spv
      COMMAND Vulkan::glslangValidator ${flags} --vn ${variable}Spirv -o ${out}/${stem}.h ${common}
      DEPENDS ${common}
      DEPFILE ${out}/${stem}.d
      COMMENT "Shader ${stem}"
      VERBATIM)
    list(APPEND headers ${out}/${stem}.h)
  endforeach()
  add_custom_target(comap_${name}_build DEPENDS ${headers})
  add_library(comap_${name} INTERFACE)
  add_dependencies(comap_${name} comap_${name}_build)
  target_include_directories(comap_${name} SYSTEM INTERFACE ${PROJECT_BINARY_DIR}/generated)
endfunction()
