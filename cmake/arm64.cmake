# Toolchain: Debian's cross compiler for 64-bit ARM; libraries from COMAP_ARM64_ROOT, an unpacked set of arm64 packages,
# with which programs also run under emulation.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES COMAP_ARM64_ROOT)
set(CMAKE_FIND_ROOT_PATH ${COMAP_ARM64_ROOT} /usr/aarch64-linux-gnu)  # the second: the C library itself
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${COMAP_ARM64_ROOT})
set(ENV{PKG_CONFIG_LIBDIR} ${COMAP_ARM64_ROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:${COMAP_ARM64_ROOT}/usr/share/pkgconfig)
set(CMAKE_C_FLAGS_INIT "-isystem ${COMAP_ARM64_ROOT}/usr/include/aarch64-linux-gnu")
set(CMAKE_CXX_FLAGS_INIT ${CMAKE_C_FLAGS_INIT})
# Libraries that libraries need.
set(arm64_libraries ${COMAP_ARM64_ROOT}/usr/lib/aarch64-linux-gnu:${COMAP_ARM64_ROOT}/lib/aarch64-linux-gnu)
set(CMAKE_EXE_LINKER_FLAGS_INIT -Wl,-rpath-link,${arm64_libraries})
set(CMAKE_SHARED_LINKER_FLAGS_INIT -Wl,-rpath-link,${arm64_libraries})
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L ${COMAP_ARM64_ROOT})
