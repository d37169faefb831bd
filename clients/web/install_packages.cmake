# cmake -DNPM=<npm> -P install_packages.cmake: installs what the lock file names into node_modules beside this script,
# unless it is there. Build directories share it, so only one installs at a time.
set(room ${CMAKE_CURRENT_LIST_DIR})
set(packages ${room}/node_modules/.package-lock.json) # npm writes it last of all
file(LOCK ${room}/../../.cache/npm DIRECTORY TIMEOUT 600)
if(EXISTS ${packages} AND NOT ${room}/package-lock.json IS_NEWER_THAN ${packages})
  return()
endif()
execute_process(COMMAND ${NPM} ci --ignore-scripts --loglevel=error WORKING_DIRECTORY ${room}
  RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "npm ci failed: the packages of ${room}/package-lock.json could not be installed")
endif()
file(TOUCH ${packages})
