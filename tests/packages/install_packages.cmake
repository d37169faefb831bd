# cmake -DNPM=<npm> -P install_packages.cmake: installs the packages of the lock file into node_modules next to this script,
# as clients/web/install_packages.cmake does for the page.
set(room ${CMAKE_CURRENT_LIST_DIR})
set(packages ${room}/node_modules/.package-lock.json) # written last by npm
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
