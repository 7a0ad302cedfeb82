# Turns each metric file into a library entry: its kernels as SPIR-V, its text, and its float64
# twin compiled from the same file. Adds everything to `target`.

find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

# Compiles shaders/framework/<stage>.comp for one metric into <id>_<stage>.h, a C array of SPIR-V.
function(compile_metric_kernel id stage defines)
  set(out ${CMAKE_CURRENT_BINARY_DIR}/metrics/${id}_${stage})
  add_custom_command(
    OUTPUT ${out}.h
    DEPFILE ${out}.d
    COMMAND ${GLSLANG_VALIDATOR} -V --quiet --target-env vulkan1.2 -I${PROJECT_SOURCE_DIR}/shaders
            -I${CMAKE_CURRENT_BINARY_DIR}/metrics/${id} ${defines} --depfile ${out}.d -o ${out}.spv
            ${PROJECT_SOURCE_DIR}/shaders/framework/${stage}.comp
    COMMAND ${SPIRV_VAL} --target-env vulkan1.2 ${out}.spv
    COMMAND ${GLSLANG_VALIDATOR} -V --quiet --target-env vulkan1.2 -I${PROJECT_SOURCE_DIR}/shaders
            -I${CMAKE_CURRENT_BINARY_DIR}/metrics/${id} ${defines} --vn ${id}_${stage} -o ${out}.h
            ${PROJECT_SOURCE_DIR}/shaders/framework/${stage}.comp
    DEPENDS ${PROJECT_SOURCE_DIR}/shaders/framework/${stage}.comp
    VERBATIM)
  set_property(SOURCE ${CMAKE_CURRENT_BINARY_DIR}/metrics/${id}.cpp APPEND PROPERTY OBJECT_DEPENDS ${out}.h)
endfunction()

# Adds every *.glsl of `folder`, and a function `merl::reflectance::<list>()` that gives them all.
function(add_metrics target folder list)
  file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/shaders/${folder}/*.glsl)
  list(SORT files)
  set(declarations "")
  set(entries "")
  foreach(file IN LISTS files)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    get_filename_component(METRIC_NAME ${file} NAME_WE)
    string(MAKE_C_IDENTIFIER ${METRIC_NAME} METRIC_ID)
    set(METRIC_FILE ${folder}/${METRIC_NAME}.glsl)
    file(READ ${file} METRIC_SOURCE)
    set(defines "")
    set(METRIC_PER_CHANNEL 0)
    if(METRIC_SOURCE MATCHES "\n// degree: ([0-9]+)(/([0-9]+))?\n")
      set(METRIC_PER_CHANNEL 1)
      set(degree_numerator ${CMAKE_MATCH_1})
      set(degree_denominator 1)
      if(CMAKE_MATCH_3)
        set(degree_denominator ${CMAKE_MATCH_3})
      endif()
      set(defines -DDEGREE_NUMERATOR=${degree_numerator} -DDEGREE_DENOMINATOR=${degree_denominator})
    endif()
    file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/metrics/${METRIC_ID}/chosen_metric.glsl
         CONTENT "#include \"${METRIC_FILE}\"\n" @ONLY)
    set(METRIC_DEGREE 0)
    if(METRIC_PER_CHANNEL)
      set(METRIC_DEGREE "${degree_numerator}.0 / ${degree_denominator}.0")
    endif()
    configure_file(${PROJECT_SOURCE_DIR}/engine/reflectance/metric.cpp.in
                   ${CMAKE_CURRENT_BINARY_DIR}/metrics/${METRIC_ID}.cpp @ONLY)
    set(stages weigh prepare norms difference)
    if(METRIC_PER_CHANNEL)
      list(APPEND stages ranges slopes)
    endif()
    foreach(stage IN LISTS stages)
      compile_metric_kernel(${METRIC_ID} ${stage} "${defines}")
    endforeach()
    target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/metrics/${METRIC_ID}.cpp)
    # Whatever a metric calls has to be inlined before its loop over voxels becomes vectors.
    set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/metrics/${METRIC_ID}.cpp PROPERTIES
      COMPILE_OPTIONS "-finline-functions;--param=max-inline-insns-auto=1000;--param=max-inline-insns-single=1000;--param=inline-unit-growth=1000")
    string(APPEND declarations "extern const Metric metric_${METRIC_ID};\n")
    string(APPEND entries "glsl::metric_${METRIC_ID}, ")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/metrics/${list}.cpp @ONLY CONTENT
"#include <vector>

#include \"engine/reflectance/metric.h\"

namespace merl::reflectance {
namespace glsl {
${declarations}}
std::span<const Metric> ${list}() {
    static const std::vector<Metric> all = {${entries}};
    return all;
}
}  // namespace merl::reflectance
")
  target_sources(${target} PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/metrics/${list}.cpp)
endfunction()
