#include "protocol/config/yaml_text.h"

#include <yaml-cpp/yaml.h>

namespace comap {

std::string yamlText(const std::string& text) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << text;
  return emitter.c_str();
}

}  // namespace comap
