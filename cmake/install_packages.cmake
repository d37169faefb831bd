# cmake -DNPM=<npm> -DROOM=<folder> -P install_packages.cmake: installs the packages of the folder's lock file into its
# node_modules, unless they are installed. Build directories share them, so a lock lets one build install at a time.
set(packages ${ROOM}/node_modules/.package-lock.json) # written last by npm
file(LOCK ${CMAKE_CURRENT_LIST_DIR}/../.cache/npm DIRECTORY TIMEOUT 600)
if(EXISTS ${packages} AND NOT ${ROOM}/package-lock.json IS_NEWER_THAN ${packages})
  return()
endif()
execute_process(COMMAND ${NPM} ci --ignore-scripts --loglevel=error WORKING_DIRECTORY ${ROOM}
  RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "npm ci failed: the packages of ${ROOM}/package-lock.json could not be installed")
endif()
file(TOUCH ${packages})
