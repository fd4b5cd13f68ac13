# Remove include directories that do not exist from all imported targets. The wheels of ROS 2
# export include directories of the machine that built them, and cmake fails on missing
# directories. An installation by apt has no such directories.
get_property(imported_targets DIRECTORY PROPERTY IMPORTED_TARGETS)
foreach(imported_target IN LISTS imported_targets)
  get_target_property(directories ${imported_target} INTERFACE_INCLUDE_DIRECTORIES)
  if(directories)
    set(present)
    foreach(directory IN LISTS directories)
      if(directory MATCHES "^[$]<" OR EXISTS "${directory}")
        list(APPEND present "${directory}")
      endif()
    endforeach()
    set_target_properties(${imported_target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${present}")
  endif()
endforeach()
